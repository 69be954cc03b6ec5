"""Test recordings in closed loop: what a model makes of a command alone."""

from collections.abc import Sequence

import numpy as np

from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Recording
from tendon_newton.data.root_mean_square import rms
from tendon_newton.simulation.hosts.replay import replay, simulated_recording

SETTLED = 2.0
"""Start of what counts [s]: one period of the paper's sinusoid, in which a start is forgotten."""


def tip_errors_of(
    recordings: Sequence[Recording], model: Model, *, time_step: float
) -> list[float]:
    """Return the distance of tips, RMS [m], from those simulated from commands and first rows."""
    trajectories = replay(recordings, model, time_step=time_step)
    return [
        tip_error(recording, simulated_recording(recording, trajectory))
        for recording, trajectory in zip(recordings, trajectories, strict=True)
    ]


def tip_error(recording: Recording, simulated: Recording) -> float:
    """Return the distance of the tips of two recordings of the same instants, RMS [m]."""
    assert recording.tip is not None
    assert simulated.tip is not None
    late = recording.time >= recording.time[0] + SETTLED
    return rms(np.linalg.norm(recording.tip - simulated.tip, axis=1)[late])
