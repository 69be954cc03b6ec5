"""What the default step leaves, on commands that real diagnoses see."""

from pathlib import Path

import numpy as np
import pytest

from tendon_newton.data.dataset import load_dataset
from tendon_newton.data.model_file import load_model
from tendon_newton.simulation.hosts.replay import replay
from tendon_newton.simulation.hosts.rollout import TIME_STEP

ANGLE, FORCE = 0.044e-3, 0.005  # rad, N: a tenth of an encoder's and a load cell's noise
CASES = ("c005", "c008", "c021")
"""Without friction, and the two on which dry friction at the end stops leaves most."""


def kept_rms(error: np.ndarray) -> float:
    """Return the RMS without the worst 2 % of the rows, which are bounces off the end stops."""
    size = np.sort(np.abs(error).ravel())
    return float(np.sqrt(np.mean(size[: int(0.98 * len(size))] ** 2)))


def check(folder: Path) -> None:
    """Compare the default step with one 16 times shorter on every recording of a dataset."""
    if not folder.is_dir():
        pytest.skip(f"needs {folder}")
    dataset = load_dataset(folder)
    recordings = (*dataset.train, *dataset.test)
    model = load_model(folder / "model.toml")
    coarse = replay(recordings, model)
    fine = replay(recordings, model, time_step=TIME_STEP / 16.0)
    for recording, a, b in zip(recordings, coarse, fine, strict=True):
        where = f"{folder.name}/{recording.name}"
        assert kept_rms(a.motor_position - b.motor_position) < ANGLE, where
        assert kept_rms(a.force - b.force) < FORCE, where


@pytest.mark.parametrize("case", CASES)
def test_the_default_step_leaves_a_tenth_of_the_sensors_noise(case: str, shared: Path) -> None:
    """On the benches and with the starting models of public challenges."""
    check(shared / "challenges" / case)


@pytest.mark.slow
def test_the_default_step_leaves_a_tenth_of_the_noise_on_all_commands(shared: Path) -> None:
    """On every public challenge."""
    for folder in sorted((shared / "challenges").glob("c???")):
        check(folder)


def test_the_default_step_leaves_a_tenth_of_the_noise_of_the_bundled_recordings() -> None:
    """Eight recordings of a finger and two springs that come with the program."""
    check(Path(__file__).parents[2] / "examples" / "hidden_friction")
