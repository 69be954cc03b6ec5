"""Sensor noise from the data alone."""

import numpy as np
import pytest

from tendon_newton.data.recording import Recording
from tendon_newton.identification.noise_floor import encoder_noise, estimate_noise_floor

COUNT = 2.0 * np.pi / 4096.0


def log(rng: np.random.Generator, colour: float, scatter: float = 0.05) -> Recording:
    """A motor that steps every 2 s, with an encoder of 4096 counts and a coloured load cell."""
    time = np.arange(0.0, 24.0, 0.0125)
    command = np.repeat(rng.uniform(0.0, 3.0, 12), 160)
    angle = np.zeros_like(command)
    for k in range(1, len(angle)):
        angle[k] = angle[k - 1] + 0.2 * (command[k] - angle[k - 1])
    noise = np.zeros_like(angle)
    for k in range(1, len(noise)):
        noise[k] = colour * noise[k - 1] + np.sqrt(1.0 - colour**2) * rng.normal(0.0, scatter)
    return Recording(
        name="log.csv",
        bench="spring_weak",
        time=time,
        command=command[:, None],
        motor_position=(np.round(angle / COUNT) * COUNT)[:, None],
        motor_velocity=np.gradient(angle, time)[:, None],
        force=(5.0 * angle + noise)[:, None],
    )


def test_an_encoders_noise_is_that_of_its_counts() -> None:
    """A twelfth of a count squared, whatever the motion."""
    angle = np.round(np.sin(np.linspace(0.0, 9.0, 900)) / COUNT) * COUNT
    assert encoder_noise(angle) == pytest.approx(COUNT / np.sqrt(12.0), rel=1e-6)


def test_an_encoder_without_counts_has_the_noise_of_its_scatter(rng: np.random.Generator) -> None:
    """A smooth signal with white noise of 1 mrad."""
    angle = np.sin(np.linspace(0.0, 9.0, 2000)) + rng.normal(0.0, 1e-3, 2000)
    assert encoder_noise(angle) == pytest.approx(1e-3, rel=0.1)


@pytest.mark.parametrize("colour", [0.0, 0.6, 0.9])
def test_a_load_cells_noise_is_its_scatter_at_rest(rng: np.random.Generator, colour: float) -> None:
    """Slow noise counts too; what a window of 0.4 s cannot see of it may be missing."""
    floor = estimate_noise_floor([log(rng, colour)])
    assert floor.force is not None
    assert floor.force == pytest.approx(0.05, rel=0.15 if colour < 0.9 else 0.45)


def test_without_a_load_cell_there_is_no_noise_to_tell(rng: np.random.Generator) -> None:
    """A recording without force gives None."""
    whole = log(rng, 0.0)
    bare = Recording(**{**vars(whole), "force": None})
    assert estimate_noise_floor([bare]).force is None
