"""The plant does what the closed forms say, and its integration error is out of sight."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import minimize

from tests.planted.physics.bench import GAIN, GRAVITY, SPOOL_RADIUS
from tests.planted.physics.causes import Causes
from tests.planted.physics.commands import COMMANDS
from tests.planted.physics.plant import STEP
from tests.planted.trials import FINGER, TAUT, WEAK, jump, rows, run, step_response

Array = NDArray[np.float64]

ENCODER_FLOOR = 0.44e-3  # [rad]
CELL_FLOOR = 0.05  # [N]


def spring_response(time: Array, start: float, end: float, damping: float) -> Array:
    """Slide of the weak spring after a jump at t = 0 [m]."""
    natural = np.sqrt((WEAK.stiffness[0] + TAUT) / WEAK.mass[0])
    shape = step_response(time, natural, damping / (2.0 * WEAK.mass[0]))
    return start + (end - start) * shape


@pytest.mark.parametrize("delay", [0.0, 0.0123456, 0.0375])
@pytest.mark.parametrize("viscous", [0.0, 1.2])
def test_spring_follows_the_closed_step_response(delay: float, viscous: float) -> None:
    """A delay, also a fraction of a step, and viscous friction enter exactly as they are named."""
    time = rows(1.5)
    motion = run("spring_weak", Causes(delay=delay, viscous=viscous), time, jump(time, 1.0, 1.4))
    rest = np.array([1.0, 1.4]) * GAIN / (WEAK.stiffness[0] + TAUT)
    damping = WEAK.damping[0] + viscous / SPOOL_RADIUS**2 * SPOOL_RADIUS
    slide = spring_response(time - 0.5 - delay, rest[0], rest[1], damping)
    assert motion.angle == pytest.approx(slide / SPOOL_RADIUS, abs=2e-6)  # 1/200 of a floor


def test_rows_are_taken_just_after_their_command_took_effect() -> None:
    """F = P (theta_d - theta) row by row, and a delay of two rows shifts it by two rows."""
    time = rows(2.0)
    command = COMMANDS["steps"](np.random.default_rng(3), time.size)
    for late in (0, 2):
        motion = run("spring_weak", Causes(delay=late / 80.0), time, command)
        heard = np.concatenate([np.full(late, command[0]), command[: command.size - late]])
        ideal = np.maximum(GAIN * (heard - motion.angle), 0.0)
        assert motion.force == pytest.approx(ideal, abs=1e-9)


def test_an_offset_is_seen_by_servo_and_reader_alike() -> None:
    """The law holds on the measured angle, while the slider rests elsewhere."""
    time = rows(1.0)
    motion = run("spring_weak", Causes(offset=0.1), time, np.full(time.size, 2.0))
    assert motion.force == pytest.approx(GAIN * (2.0 - motion.angle), abs=1e-9)
    assert motion.angle - motion.coordinates[:, 0] / SPOOL_RADIUS == pytest.approx(0.1, abs=1e-12)
    assert motion.force == pytest.approx(WEAK.stiffness[0] * motion.coordinates[:, 0], abs=1e-9)


def finger_potential(q: Array, command: float) -> float:
    """Energy of springs, weight and servo [J]; its least value is the rest."""
    first, second = FINGER.length
    height = -np.sin(q[0]) * np.array([first / 2.0, first])
    height[1] -= np.sin(q[0] + q[1]) * second / 2.0
    springs = 0.5 * float(np.dot(FINGER.stiffness, q**2))
    pulled = command - float(np.dot(FINGER.moment_arm, q)) / SPOOL_RADIUS
    servo = 0.5 * GAIN * SPOOL_RADIUS * pulled**2
    return springs + GRAVITY * float(np.dot(FINGER.mass, height)) + servo


def finger_kinetic(q: Array, v: Array) -> Array:
    """Kinetic energy [J] from the velocities of both centres of mass, q and v (T, 2)."""
    first, second = FINGER.length
    both, spin = q[:, 0] + q[:, 1], v[:, 0] + v[:, 1]
    x = -first * np.sin(q[:, 0]) * v[:, 0] - second / 2.0 * np.sin(both) * spin
    z = first * np.cos(q[:, 0]) * v[:, 0] + second / 2.0 * np.cos(both) * spin
    proximal = FINGER.mass[0] * first**2 / 3.0 * v[:, 0] ** 2
    distal = FINGER.mass[1] * (x**2 + z**2 + second**2 / 12.0 * spin**2)
    return 0.5 * (proximal + distal)


def test_finger_rests_where_its_energy_is_least() -> None:
    """From a start elsewhere it settles in the minimum of springs, weight and servo."""
    time = rows(3.0)
    motion = run("finger", Causes(), time, jump(time, 2.4, 1.5))
    for row, command in ((0, 2.4), (-1, 1.5)):
        least = minimize(finger_potential, [0.5, 0.5], args=(command,), tol=1e-14).x
        assert motion.coordinates[row] == pytest.approx(least, abs=1e-6)  # minimize's own limit


def test_undamped_finger_keeps_its_energy() -> None:
    """Without damping, springs, weight, servo and motion sum to a constant after a jump."""
    time = rows(0.4, rate=20e3)
    motion = run("finger", Causes(damper_scale=0.0), time, jump(time, 1.5, 1.9, at=0.1), step=10e-6)
    q = motion.coordinates[time > 0.1]
    speed = (8.0 * (q[3:-1] - q[1:-3]) - (q[4:] - q[:-4])) / (12.0 * time[1])
    kinetic = finger_kinetic(q[2:-2], speed)
    total = kinetic + np.array([finger_potential(angles, 1.9) for angles in q[2:-2]])
    assert np.ptp(total) < 1e-3 * np.ptp(kinetic)  # leapfrog: bounded, of second order


def test_bristles_hold_a_load_below_the_friction_and_give_way_above() -> None:
    """A jump of 0.4 N against 1 N of friction bends bristles by micrometres and does not creep."""
    time, causes = rows(4.0), Causes(coulomb=1.0)
    held = run("spring_weak", causes, time, jump(time, 2.0, 2.0 + 0.4 / GAIN))
    moved = held.coordinates[:, 0] - held.coordinates[0, 0]
    assert 1e-6 < moved[-1] < 3.0 * causes.bristle  # the jump itself overshoots
    assert moved[-1] == pytest.approx(moved[time > 1.0], abs=1e-9)
    slid = run("spring_weak", causes, time, jump(time, 2.0, 2.0 + 1.5 / GAIN))
    assert slid.coordinates[-1, 0] - slid.coordinates[0, 0] > 20.0 * causes.bristle


@pytest.mark.parametrize("rate", [0.8, -0.8])
def test_sliding_friction_is_what_its_name_says(rate: float) -> None:
    """In a steady pull the cell sees the motor's force less the friction, F (1 + mu) and all."""
    time = rows(2.0)
    command = 2.5 + rate * time
    motion = run("spring_weak", Causes(coulomb=0.9, load=0.15), time, command)
    motor = GAIN * (command - motion.angle)
    sense = np.sign(rate)
    expected = (motor - sense * 0.9) / (1.0 + sense * 0.15)
    assert motion.force[80:] == pytest.approx(expected[80:], abs=1e-3)


@pytest.mark.parametrize("causes", [Causes(), Causes(viscous=1.5, coulomb=0.8, load=0.1)])
@pytest.mark.parametrize("bench", ["finger", "spring_strong"])
def test_integration_error_is_far_below_the_sensors(bench: str, causes: Causes) -> None:
    """Half the step changes angle and force by less than a tenth of what the sensors resolve."""
    time = rows(6.0)
    command = COMMANDS["steps"](np.random.default_rng(1), time.size)
    whole, half = (run(bench, causes, time, command, step=step) for step in (STEP, STEP / 2.0))
    assert np.sqrt(np.mean((whole.angle - half.angle) ** 2)) < 0.1 * ENCODER_FLOOR
    assert np.sqrt(np.mean((whole.force - half.force) ** 2)) < 0.1 * CELL_FLOOR
