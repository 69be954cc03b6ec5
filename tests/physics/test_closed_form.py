"""Benches whose motion or rest has a formula."""

import numpy as np
import pytest
from scipy.optimize import fsolve

from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.mechanisms.worlds import build_model
from tendon_newton.simulation.hosts.rollout import TIME_STEP
from tendon_newton.simulation.hosts.tendon_solver import TendonSolver
from tests.physics.runs import DELAYED, GAIN, RADIUS, ROWS, follow, ideal_model, run_of, simulate

MASS, DAMPING = 0.05, 5.0  # kg, N s/m: both sliders


@pytest.mark.parametrize(("bench", "stiffness"), [("spring_weak", 200.0), ("spring_strong", 800.0)])
def test_slider_answers_a_step_as_a_second_order_system(bench: str, stiffness: float) -> None:
    """M q'' + c q' + (k + P/r) q = P theta_d.

    As F = P (theta_d - q/r) stays positive and below 21 N.
    """
    before, after = 0.5, 1.5
    rows = 40
    command = np.full(rows, after)
    command[0] = before
    (run,) = simulate([run_of(command, bench=bench)], ideal_model(), time_step=TIME_STEP)
    t = np.maximum(np.arange(rows) / ROWS - 1.0 / ROWS, 0.0)
    total = stiffness + GAIN / RADIUS
    decay = DAMPING / (2.0 * MASS)
    frequency = np.sqrt(total / MASS - decay**2)
    ringing = np.exp(-decay * t) * (
        np.cos(frequency * t) + decay / frequency * np.sin(frequency * t)
    )
    travel = GAIN / total * (after - (after - before) * ringing)
    # 1e-3 of the step: the second-order scheme leaves (h omega)^2 = 1e-3 at most on the stronger
    # spring
    assert run.joint_position[:, 0] == pytest.approx(travel, abs=1e-3 * GAIN / total)
    force = GAIN * (command - travel / RADIUS)
    assert run.force[:, 0] == pytest.approx(force, abs=1e-3 * GAIN)


@pytest.mark.parametrize("command", [1.0, 1.6, 2.2])
def test_finger_rests_where_springs_gravity_and_tendon_balance(command: float) -> None:
    """Each joint: k q = arm F + gravity's torque, written out for two links."""

    def imbalance(q: np.ndarray) -> list[float]:
        tension = GAIN * (command - (0.0080 * q[0] + 0.0055 * q[1]) / RADIUS)
        distal = 0.008 * 9.81 * 0.0125 * np.cos(q[0] + q[1])
        middle = (0.012 * 0.015 + 0.008 * 0.030) * 9.81 * np.cos(q[0])
        return [
            0.0080 * tension + middle + distal - 0.045 * q[0],
            0.0055 * tension + distal - 0.030 * q[1],
        ]

    rest = fsolve(imbalance, [0.5, 0.5], xtol=1e-12)
    (run,) = simulate([run_of(np.full(81, command))], ideal_model(), time_step=TIME_STEP)
    assert run.joint_position[0] == pytest.approx(rest, abs=1e-6)  # float32 asset numbers
    assert run.joint_position[-1] == pytest.approx(rest, abs=1e-6)  # and it stays there
    tension = GAIN * (command - np.dot([0.0080, 0.0055], rest) / RADIUS)
    assert run.force[-1, 0] == pytest.approx(tension, rel=1e-4)


def test_what_sticks_holds_still_to_the_last_bit() -> None:
    """Ten seconds after the last step of the command nothing has moved: friction is not a creep."""
    command = np.full(int(12 * ROWS), 2.0)
    command[:8] = 0.5
    (run,) = simulate(
        [run_of(command)], ideal_model(coulomb_friction={"force": 0.7}), time_step=TIME_STEP
    )
    assert np.ptp(run.joint_position[:30], axis=0).min() > 0.1
    late = slice(-int(10 * ROWS), None)
    assert np.all(run.motor_position[late] == run.motor_position[-1])
    # the joints may still ring against each other for a while; their sum is what the tendon holds
    assert run.joint_position[-1] == pytest.approx(run.joint_position[-200], abs=1e-9)
    assert np.all(run.motor_velocity[late] == pytest.approx(0.0, abs=1e-9))


def test_joint_friction_and_tendon_friction_stop_together() -> None:
    """A stuck tendon leaves two joints one way to move.

    When one of them stops, both do, even on their end stops.
    """
    command = np.full(240, 5.5)
    command[:8] = 1.0
    (run,) = simulate(
        [run_of(command)],
        ideal_model(coulomb_friction={"force": 0.7}),
        time_step=1.0e-3,  # long enough that the stops' own frequency is not resolved
        joint_friction=(1.0e-3, 5.0e-4),
    )
    assert run.joint_position[-1] == pytest.approx([1.75, 1.40], abs=2e-3)
    assert np.all(run.joint_position[-80:] == run.joint_position[-1])


def test_a_string_that_is_let_out_a_little_does_not_push() -> None:
    """A goal of 0.03 rad below the stop would be 0.126 N of push: none ever comes."""
    command = np.repeat([0.5, -0.03, 0.2, -0.03], 20)
    (run,) = simulate([run_of(command, bench="spring_weak")], ideal_model(), time_step=TIME_STEP)
    assert run.force.min() == 0.0
    assert np.all(run.force[[39, 79], 0] == 0.0)


STEP = 2.5e-4  # s
FRICTION = np.array([1.0e-3, 5.0e-4])  # N m


def test_tendon_work_is_energy_gained_plus_heat() -> None:
    """Work of the tension at the load cell = change of energy + damping + joint friction."""
    model = build_model(load_mechanism("finger"), 1, device="cpu")
    model.joint_friction.assign(FRICTION.astype(np.float32))
    effects = DELAYED | {
        "command_delay": {"delay": 0.0},
        "coulomb_friction": {"force": 0.3},
        "viscous_friction": {"coefficient": 0.2},
    }
    solver = TendonSolver(model, ideal_model(**effects), max_step=STEP, update_bodies=False)
    time = STEP * np.arange(6000)
    command = 1.6 - 0.8 * np.cos(2.0 * np.pi * time)
    q, v, power = follow(solver, model, command, STEP)
    work = np.sum(power.mean(axis=1)) * STEP
    damping = np.trapezoid(v**2 @ [5e-4, 3e-4], dx=STEP)
    friction = np.trapezoid(np.abs(v) @ FRICTION, dx=STEP)
    stored = energy(q[-1], v[-1]) - energy(q[0], v[0])
    assert damping > 0.01 * work
    assert friction > 0.01 * work
    # 1e-4: trapezium rule over the reversals of friction, float32 of Newton's state
    assert work == pytest.approx(stored + damping + friction, rel=1e-4)


def energy(q: np.ndarray, v: np.ndarray) -> float:
    """Return kinetic energy, springs and gravity of the nominal finger [J], by hand."""
    a, b = q[0], q[0] + q[1]
    u, w = v[0], v[0] + v[1]
    middle = 0.5 * (0.012 * 0.015**2 + 0.012 * 0.030**2 / 12.0) * u**2
    speed = (0.030 * u) ** 2 + (0.0125 * w) ** 2 + 2.0 * 0.030 * 0.0125 * u * w * np.cos(q[1])
    distal = 0.5 * 0.008 * speed + 0.5 * (0.008 * 0.025**2 / 12.0) * w**2
    springs = 0.5 * 0.045 * q[0] ** 2 + 0.5 * 0.030 * q[1] ** 2
    height = 0.012 * 0.015 * np.sin(a) + 0.008 * (0.030 * np.sin(a) + 0.0125 * np.sin(b))
    return float(middle + distal + springs - 9.81 * height)
