"""The DC servo against the text book: stall, no-load speed, the line between them, its rotor."""

from dataclasses import replace

import numpy as np
import pytest

from tendon_newton.data.bench_overrides import BenchOverrides
from tendon_newton.data.model_file import NamedValues
from tendon_newton.data.recording import Array
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.simulation.hosts.replay import replay
from tendon_newton.simulation.hosts.rollout import Trajectory
from tests.made import stated_model
from tests.physics.runs import RADIUS, run_of, simulate

CONSTANT, RESISTANCE, SUPPLY, INERTIA = 1.43, 15.0, 9.0, 0.0025  # N m/A, ohm, V, kg m2
SERVO = {
    "duty_per_rad": 0.1, "max_duty": 0.2, "supply_voltage": SUPPLY, "torque_constant": CONSTANT,
    "resistance": RESISTANCE, "armature": INERTIA, "spool_radius": RADIUS,
}  # fmt: skip
MODEL = stated_model("pwm_servo", SERVO)
WALL = BenchOverrides(stiffness=(1.0e6,))
STALL = 0.2 * SUPPLY * CONSTANT / RESISTANCE  # N m at the greatest duty
NO_LOAD = 0.2 * SUPPLY / CONSTANT  # rad/s
FAR = 60.0  # rad: an error that asks for the greatest duty throughout
STEP = 1.25e-4  # s


def held(error: float) -> float:
    """Return the force [N] with which the servo pulls a wall, 1 s after the command [rad]."""
    run = run_of(np.where(np.arange(80) < 4, 0.0, error), bench="spring_weak", bench_overrides=WALL)
    return float(simulate([run], MODEL, time_step=STEP)[0].force[-1, 0])


def spun(damping: float, *, rate: float = 80.0, rows: int = 80) -> Trajectory:
    """Return how the shaft turns an arm that weighs nothing against a damper [N m s/rad].

    From its first row on it is asked to turn as fast as it can.
    """
    arm = BenchOverrides(mass=(1.0e-9,), length=(1.0e-3,), damping=(damping,))
    run = run_of(
        np.full(rows, FAR), bench="pendulum", rate=rate, start="first_row", bench_overrides=arm
    )
    return simulate([run], MODEL, time_step=STEP)[0]


@pytest.mark.parametrize(("error", "duty"), [(0.5, 0.05), (1.9, 0.19), (2.5, 0.2), (40.0, 0.2)])
def test_a_stalled_servo_pulls_with_duty_times_stall_force(error: float, duty: float) -> None:
    """F = k_t u V / (R r), u = k_u (theta_d - theta) up to the greatest duty.

    The wall's give of 0.2 mrad per newton takes 1e-3 of a small error.
    """
    give = 0.2 / (RADIUS * 1e6 * RADIUS) if error < 2.0 else 0.0
    expected = CONSTANT * duty * SUPPLY / (RESISTANCE * RADIUS)
    assert held(error) == pytest.approx(expected, rel=1e-3 + give)


@pytest.mark.parametrize(("error", "duty"), [(0.0, 0.02), (0.5, 0.07), (1.9, 0.2), (-0.1, 0.01)])
def test_a_loop_may_always_add_a_duty(error: float, duty: float) -> None:
    """F follows k_u (theta_d - theta) + u_0 up to the greatest duty: u_0 alone keeps it taut."""
    values = {**SERVO, "duty_offset": 0.02}
    model = stated_model("pwm_servo", values)
    run = run_of(np.full(80, error), bench="spring_weak", bench_overrides=WALL)
    force = simulate([run], model, time_step=STEP)[0].force[-1, 0]
    expected = CONSTANT * duty * SUPPLY / (RESISTANCE * RADIUS)
    assert force == pytest.approx(expected, rel=1e-3 + 0.2 / (RADIUS * 1e6 * RADIUS))


def test_an_unloaded_servo_turns_at_the_speed_whose_emf_is_the_voltage() -> None:
    """theta_dot = u V / k_t."""
    assert spun(0.0).motor_velocity[-1, 0] == pytest.approx(NO_LOAD, rel=1e-6)


@pytest.mark.parametrize("damping", [0.02, 0.1, 0.5, 2.0])
def test_back_emf_is_the_slope_between_stall_and_no_load(damping: float) -> None:
    """Turning steadily, tau = k_t (u V - k_t theta_dot) / R; the damper takes what it gives."""
    out = spun(damping)
    speed, torque = out.motor_velocity[-1, 0], out.force[-1, 0]
    assert torque == pytest.approx(STALL - CONSTANT**2 / RESISTANCE * speed, rel=1e-6)
    assert torque == pytest.approx(damping * speed, rel=1e-6)
    assert speed == pytest.approx(STALL / (damping + CONSTANT**2 / RESISTANCE), rel=1e-6)


def test_a_step_of_duty_turns_the_rotor_with_torque_over_inertia() -> None:
    """theta_ddot = k_t u V / (R J) at first, and speed nears its end with J R / k_t^2."""
    rate = 1000.0
    out = spun(0.0, rate=rate, rows=101)
    constant = INERTIA * RESISTANCE / CONSTANT**2
    expected = NO_LOAD * -np.expm1(-out.time / constant)
    assert out.motor_velocity[:, 0] == pytest.approx(expected, abs=1e-4 * NO_LOAD)  # second order
    first: Array = out.motor_velocity[:2, 0]
    # half a row of back-EMF is missing from the difference
    slope = (first[1] - first[0]) * rate * (1.0 + 0.5 / (rate * constant))
    assert slope == pytest.approx(STALL / INERTIA, rel=1e-3)


def test_a_motor_that_drives_out_loses_to_its_guides_what_the_string_carries() -> None:
    """The slider feels F exp(mu): its string pulls while the motor's own force is negative."""
    lossy = NamedValues(name="routing_friction", values={"exponent": 0.2})
    rate = 8000.0  # Hz
    command = np.where(np.arange(2400) < 1600, 12.0, 0.0)
    run = run_of(command, bench="spring_weak", rate=rate)
    (out,) = simulate([run], replace(MODEL, effects=(lossy,)), time_step=STEP)
    (joint,) = load_mechanism("spring_weak").joints
    travel, speed = out.joint_position[:, 0], RADIUS * out.motor_velocity[:, 0]
    felt = joint.stiffness * (travel - joint.rest) + joint.damping * speed
    felt += joint.mass * np.gradient(speed, 1.0 / rate)
    rows = slice(1610, 1800)
    error = command[rows] - out.motor_position[rows, 0]
    assert (error < 0.0).all()
    assert (out.force[rows] > 0.1).all()
    np.testing.assert_allclose(felt[rows] / out.force[rows, 0], np.exp(0.2), rtol=1e-2)


def test_a_start_at_a_measured_angle_stretches_its_string() -> None:
    """At the first row the string carries what its slider takes there: F = k (r theta - l)."""
    stiffness, angle = 8.0e3, 1.0  # N/m, rad
    soft = NamedValues(name="tendon_compliance", values={"stiffness": stiffness})
    run = run_of(np.full(3, angle), bench="spring_strong", start="first_row", angle=angle)
    (out,) = simulate([run], replace(MODEL, effects=(soft,)), time_step=STEP)
    (joint,) = load_mechanism("spring_strong").joints
    lead = RADIUS * out.motor_position[0, 0] - out.joint_position[0, 0]
    assert out.motor_position[0, 0] == pytest.approx(angle, abs=1e-3)  # the guide's give
    assert out.force[0, 0] == pytest.approx(stiffness * lead, rel=1e-6)  # radius: float32
    assert out.force[0, 0] == pytest.approx(joint.stiffness * out.joint_position[0, 0], rel=1e-6)


def test_a_model_says_how_strong_its_motor_is_before_the_gear() -> None:
    """An asset's 21 N are what a servo can pull; its model states a motor that gives more."""
    strong = {**SERVO, "max_duty": 0.5}
    expected = CONSTANT * 0.5 * SUPPLY / (RESISTANCE * RADIUS)
    run = run_of(np.where(np.arange(80) < 4, 0.0, FAR), bench="spring_weak", bench_overrides=WALL)
    weak, stated = (
        replay([run], replace(MODEL, actuator=NamedValues(name="pwm_servo", values=values)))[
            0
        ].force
        for values in (strong, {**strong, "force_limit": 60.0})
    )
    # a force at its limit damps nothing, so that the rotor swings about it
    assert weak[40:, 0].mean() == pytest.approx(21.0, rel=0.02)
    assert stated[-1, 0] == pytest.approx(expected, rel=1e-3)
    assert expected > 30.0
