"""The drive with kp and kd against what its equation says by hand."""

import numpy as np
import pytest

from tendon_newton.data.bench_overrides import BenchOverrides
from tests.made import stated_model
from tests.physics.runs import run_of, simulate

KP, KD, MOST, INERTIA = 2.0, 0.08, 0.9, 0.01  # N m/rad, N m s/rad, N m, kg m2
DRIVE = {"kp": KP, "kd": KD, "max_torque": MOST, "armature": INERTIA, "spool_radius": 1.0}
MODEL = stated_model("pd_torque", DRIVE)
FEATHER = BenchOverrides(mass=(1.0e-9,), length=(1.0e-3,))


def test_a_drive_sags_by_the_load_over_kp() -> None:
    """k_p (theta_d - theta) = m g l sin theta at rest."""
    run = run_of(np.full(400, 0.6), bench="pendulum")
    (out,) = simulate([run], MODEL, time_step=5e-4)
    theta = out.motor_position[-1, 0]
    numbers = BenchOverrides(mass=(0.49,), length=(0.1,)).given
    weight = numbers["mass"][0] * 9.81 * numbers["length"][0] * np.sin(theta)
    assert KP * (0.6 - theta) == pytest.approx(weight, rel=1e-6)
    assert out.force[-1, 0] == pytest.approx(weight, rel=1e-6)


def test_a_free_rotor_swings_in_with_its_own_frequency_and_damping() -> None:
    """J theta'' + k_d theta' + k_p theta = k_p theta_d, from rest, below the limit."""
    goal = 0.3
    command = np.where(np.arange(400) < 4, 0.0, goal)
    run = run_of(command, bench="pendulum", rate=1000.0, bench_overrides=FEATHER)
    (out,) = simulate([run], MODEL, time_step=1.25e-4)
    natural, ratio = np.sqrt(KP / INERTIA), KD / (2.0 * np.sqrt(KP * INERTIA))
    rate = natural * np.sqrt(1.0 - ratio**2)
    t = np.maximum(out.time - out.time[4], 0.0)
    swing = np.cos(rate * t) + ratio * natural / rate * np.sin(rate * t)
    expected = goal * (1.0 - np.exp(-ratio * natural * t) * swing)
    np.testing.assert_allclose(out.motor_position[:, 0], expected, atol=2e-3 * goal)


def test_a_drive_gives_no_more_than_its_greatest_torque() -> None:
    """Far from its goal a rotor gains max_torque / J each second."""
    run = run_of(
        np.full(60, 50.0), bench="pendulum", rate=1000.0, start="first_row", bench_overrides=FEATHER
    )
    (out,) = simulate([run], MODEL, time_step=1.25e-4)
    np.testing.assert_allclose(out.motor_velocity[:, 0], MOST / INERTIA * out.time, rtol=1e-6)


def test_a_drive_that_is_off_gives_nothing() -> None:
    """Neither stiffness nor damping is left: a pendulum swings about straight down."""
    run = run_of(np.full(300, 1.0), bench="pendulum", start="first_row", angle=0.2)
    off = type(run)(**{**vars(run), "enabled": np.zeros(300, dtype=bool)})
    (out,) = simulate([off], MODEL, time_step=5e-4)
    assert out.motor_position[:, 0].min() == pytest.approx(-0.2, rel=0.05)
    assert np.abs(out.motor_position).max() <= 0.2 + 1e-6
