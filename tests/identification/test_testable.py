"""How little is too little for a name."""

import numpy as np
import pytest

from tendon_newton.data.recording import Recording
from tendon_newton.identification.noise_floor import NoiseFloor
from tendon_newton.identification.testable import too_little, turns

NOISE = NoiseFloor(theta=1e-3, force=None)


def moved(angle: np.ndarray, rate: float = 80.0) -> Recording:
    """A motor that went along some angles, shape (T,)."""
    time = np.arange(len(angle)) / rate
    column = angle[:, None]
    return Recording(
        name="made up", bench="finger", time=time, command=column, motor_position=column,
        motor_velocity=np.gradient(column, time, axis=0),
    )  # fmt: skip


WAVE = 0.5 * np.sin(np.linspace(0.0, 20.0, 400))


@pytest.mark.parametrize(
    ("angle", "said"),
    [
        (WAVE[:80], "they last 0.99 s together; 3 s are"),
        (1e-3 * WAVE, "the motor moves by 1 mrad; 10 mrad are"),
        (np.linspace(0.0, 1.0, 400), "the motor turns back 0 times; 2 are"),
    ],
)
def test_what_is_too_little_is_said(angle: np.ndarray, said: str) -> None:
    """Seconds, way and turns, each with what came and what is asked."""
    told = too_little([moved(angle)], NOISE)
    assert told is not None
    assert said in told


def test_enough_is_enough() -> None:
    """Five seconds of a wave."""
    assert too_little([moved(WAVE)], NOISE) is None


def test_noise_turns_nothing_back() -> None:
    """Three turns of a triangle, with noise below the reach at every row."""
    triangle = np.concatenate([np.linspace(a, b, 50) for a, b in ((0, 1), (1, 0), (0, 1), (1, 0))])
    noise = 4e-3 * np.random.default_rng(0).uniform(-1.0, 1.0, len(triangle))
    assert turns(triangle + noise, 0.01) == 3
