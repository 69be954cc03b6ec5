"""What the default step leaves, on commands that real diagnoses see."""

from pathlib import Path

import numpy as np
import pytest

from tendon_newton.dataset import load_dataset
from tendon_newton.model_file import load_model
from tendon_newton.simulation.replay import replay
from tendon_newton.simulation.rollout import TIME_STEP

ANGLE, FORCE = 0.044e-3, 0.005  # rad, N: a tenth of an encoder's and a load cell's noise
CASES = ("c001", "c005", "c013")
"""One starting model with viscous and dry friction, two without."""


def kept_rms(error: np.ndarray) -> float:
    """Return the RMS without the worst 2 % of the rows, which are bounces off the end stops."""
    size = np.sort(np.abs(error).ravel())
    return float(np.sqrt(np.mean(size[: int(0.98 * len(size))] ** 2)))


@pytest.mark.parametrize("case", CASES)
def test_the_default_step_leaves_a_tenth_of_the_sensors_noise(case: str, shared: Path) -> None:
    """Against a step 16 times shorter, on all three benches."""
    folder = shared / "challenges" / case
    if not folder.is_dir():
        pytest.skip(f"needs {folder}")
    recordings = load_dataset(folder).test
    model = load_model(folder / "model.toml")
    coarse = replay(recordings, model)
    fine = replay(recordings, model, time_step=TIME_STEP / 16.0)
    for recording, a, b in zip(recordings, coarse, fine, strict=True):
        assert kept_rms(a.motor_position - b.motor_position) < ANGLE, recording.name
        assert kept_rms(a.force - b.force) < FORCE, recording.name
