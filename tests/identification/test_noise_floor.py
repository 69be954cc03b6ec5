"""Sensor noise from the data alone."""

import numpy as np
import pytest

from tendon_newton.data.recording import Recording
from tendon_newton.identification.cutting import hold_out
from tendon_newton.identification.noise_floor import NoiseFloor, encoder_noise, force_noise
from tendon_newton.identification.testable import too_little, turns
from tests.importers.logs import recording
from tests.made import recorded

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
    return recorded(
        time,
        np.round(angle / COUNT) * COUNT,
        bench="spring_weak",
        command=command,
        motor_velocity=np.gradient(angle, time),
        force=5.0 * angle + noise,
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
    floor = force_noise([log(rng, colour)])
    assert floor == pytest.approx(0.05, rel=0.15 if colour < 0.9 else 0.45)


HUM = 0.1 * np.sin(np.arange(2000) / 50.0)  # N m
WHITE = 0.01 * np.random.default_rng(0).standard_normal(2000)  # N m


@pytest.mark.parametrize(
    ("torque", "noise"),
    [
        (0.0065 * np.round(HUM / 0.0065), 0.0065 / np.sqrt(12.0)),
        (0.0065 * np.round(HUM / 0.0065) * (np.arange(2000) > 1000), 0.0065 / np.sqrt(12.0)),
        (0.002 * np.round((HUM + WHITE) / 0.002), 0.01),
        (np.repeat((HUM + WHITE)[::3], 3)[:2000], 0.01),
        (0.1 * np.sign(HUM), 1e-6),  # dry friction alone has two values, and these are no counts
        (np.where(np.arange(2000) < 3, 0.0, 0.1 * np.sign(HUM)), 1e-6),
    ],
)
def test_a_led_shafts_torque_is_no_better_than_its_counts(torque: np.ndarray, noise: float) -> None:
    """Coarse counts hardly change from row to row, nor does what is held for three rows."""
    time, angle = np.arange(2000) / 100.0, COUNT * np.round(np.sin(np.arange(2000) / 50.0) / COUNT)
    shaft = recorded(time, angle, bench="pendulum", force=torque, joint_load=np.zeros(2000))
    assert force_noise([shaft]) == pytest.approx(noise, rel=0.15)


def test_without_a_load_cell_there_is_no_noise_to_tell(rng: np.random.Generator) -> None:
    """A recording without force gives None."""
    whole = log(rng, 0.0)
    bare = Recording(**{**vars(whole), "force": None})
    assert force_noise([bare]) is None


def test_what_is_held_out_is_the_end_and_nothing_of_it_is_fitted() -> None:
    """The two parts put together are the recording, row by row."""
    time = np.arange(800) / 80.0
    theta = np.sin(time)[:, None]
    whole = recording(
        time=time,
        motor_position=theta,
        motor_velocity=np.cos(time)[:, None],
        command=theta,
        force=theta + 2.0,
    )
    (train,), (test,) = hold_out([whole], 0.3)
    np.testing.assert_array_equal(np.concatenate([train.time, test.time]), whole.time)
    np.testing.assert_array_equal(
        np.concatenate([train.motor_position, test.motor_position]), whole.motor_position
    )
    assert test.duration / whole.duration == pytest.approx(0.3, abs=2.0 / 800)
    assert (train.start, test.start) == (whole.start, "first_row")


NOISE = NoiseFloor(theta=1e-3, force=None)


def moved(angle: np.ndarray, rate: float = 80.0) -> Recording:
    """A motor that went along some angles, shape (T,)."""
    return recorded(np.arange(len(angle)) / rate, angle, bench="finger", command=angle)


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
