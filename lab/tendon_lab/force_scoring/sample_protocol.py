"""Which of the paper's experiments a test recording is."""

import re
from dataclasses import dataclass
from pathlib import PurePath

import numpy as np

from tendon_newton.data.excitations import TEST_ANGLES
from tendon_newton.data.recording import Recording

HOLDS = (1.0, 2.0, 3.0)  # Times for which the paper's test steps are held [s]
HOLD_TOLERANCE = 0.1
"""Share by which a hold may be off [1]: commands fall on rows, and rows can be lost."""
RUN_NUMBER = re.compile(r"[_-]?\d+$")


@dataclass(frozen=True, kw_only=True)
class Experiment:
    """Kind of a test recording in the paper's protocol."""

    bench: str
    kind: str  # ``steps``, or the recording's name without bench and number
    hold: float | None = None  # Time for which a step is held [s]

    @property
    def label(self) -> str:
        """Return words for a table."""
        held = "" if self.hold is None else f", held {self.hold:g} s"
        return f"{self.bench}: {self.kind.replace('_', ' ')}{held}"


def experiment_of(recording: Recording) -> Experiment:
    """Say which experiment a recording is: steps by their command, all else by its name."""
    hold = step_hold(recording)
    if hold is not None:
        return Experiment(bench=recording.bench, kind="steps", hold=hold)
    stem = RUN_NUMBER.sub("", PurePath(recording.name).stem)
    kind = stem.removeprefix(recording.bench).strip("_-") or stem
    return Experiment(bench=recording.bench, kind=kind)


def step_hold(recording: Recording) -> float | None:
    """Return how long the paper's test steps are held [s]; None if the command is no such."""
    if recording.command is None:
        return None
    command = recording.command[:, 0]
    if not np.isclose(command[:, None], TEST_ANGLES, atol=1.0e-3).any(axis=1).all():
        return None
    changes = recording.time[1:][np.abs(np.diff(command)) > 1.0e-3]
    if changes.size < len(TEST_ANGLES) - 1:
        return None
    held = float(np.median(np.diff(changes)))
    near = [hold for hold in HOLDS if abs(held - hold) <= HOLD_TOLERANCE * hold]
    return near[0] if near else None
