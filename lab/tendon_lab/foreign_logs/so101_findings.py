"""What the logs of an SO-101 arm tell about themselves."""

from collections.abc import Iterator, Sequence
from math import pi

import numpy as np

from tendon_newton.data.checks.finding import Examined, Finding
from tendon_newton.data.checks.lint_checks import blocked_rows
from tendon_newton.data.importers.imported import ImportedLog
from tendon_newton.data.recording import Recording

COUNT = 2.0 * pi / 4096.0  # [rad] of the STS3215's magnetic encoder (Feetech memory table)
ON_GRID = 0.02  # [1] of a count: what rounding to six digits leaves


def stops(log: ImportedLog) -> Iterator[Finding]:
    """A joint that goes no further, either way, while its goal does and its current rises."""
    current, command = log.recording.current, log.recording.command
    assert current is not None
    assert command is not None
    theta, goal = log.recording.motor_position[:, 0], command[:, 0]
    for side, word in ((1.0, "above"), (-1.0, "below")):
        held = blocked_rows(theta, goal, side)
        if held.any():
            yield Examined(log.recording.name, "theta").caution(
                f"{held.sum()} rows stay at {theta[held].mean():.3f} rad with theta_d up "
                f"to {1e3 * np.abs(goal - theta)[held].max():.0f} mrad {word}; the current rises "
                f"to {current[held].max():.1f} A there and is {np.median(current):.2f} A else",
                "something solid is in the way: these rows tell of no servo, and no "
                "other motion goes there",
            )


def folder_findings(logs: Sequence[ImportedLog]) -> Iterator[Finding]:
    """Say what all motions have in common."""
    yield Examined("all", "t").caution(
        "commands and states have the same stamps to the last digit",
        "one of the two was not stamped when it happened: a delay found here holds up "
        "to a row of 20 ms",
    )
    yield from grids(logs)


def shaft_turns(recordings: Sequence[Recording]) -> float:
    """Return how many radians the shaft turns in one that was logged, by the encoder's grid."""
    counts = np.concatenate([r.motor_position[:, 0] for r in recordings]) / COUNT
    away = np.abs(counts - np.round(counts))
    if np.all(away > 0.5 - ON_GRID) or not np.any(away > ON_GRID):
        return 1.0
    return 1.0 / float(np.median(np.diff(np.unique(counts))))


def grids(logs: Sequence[ImportedLog]) -> Iterator[Finding]:
    """Joints whose angle is no count of the shaft."""
    for joint in dict.fromkeys(log.conditions["joint"] for log in logs):
        turns = shaft_turns([log.recording for log in logs if log.conditions["joint"] == joint])
        if turns != 1.0:
            yield Examined("all", "theta").note(
                f"{joint}: angles lie on no grid of {1e3 * COUNT:.3f} mrad but "
                f"{1e3 * COUNT / turns:.3f} mrad apart",
                "it was scaled before it was logged: if that is one count, a logged radian is "
                f"{turns:.2f} of the shaft's",
            )
