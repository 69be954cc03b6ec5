"""What a servo's firmware does to its goal and its duty, against numbers worked out by hand."""

import math
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tendon_newton.data.bench_overrides import BenchOverrides
from tendon_newton.data.model_file import Model, NamedValues
from tendon_newton.effects import hysteresis
from tests.effect_bench import GAIN, ROW, commanded, run
from tests.effect_bench import simulate as bench_simulate
from tests.made import stated_model
from tests.physics.runs import RADIUS, run_of, simulate

WALL = {"stiffness": 1e6}
"""A spring that hardly moves (21 um under 21 N), so that the force alone is seen."""
LIMIT = 21.0  # [N] of the servo
JUMP, AT = 2.0, 20  # [rad], and the row of the jump


def jump(rows: int = 120) -> np.ndarray:
    """A command that jumps [rad], shape (rows,)."""
    return np.where(np.arange(rows) < AT, 0.0, JUMP)


def goal_of(effects: dict) -> np.ndarray:
    """Return the goal [rad] that a stiff wall feels after a jump, shape (rows,)."""
    out = run(jump(), effects, **WALL)
    return out["force"] / GAIN + out["theta"]


def test_a_goal_follows_a_jump_at_its_own_speed() -> None:
    """G = omega (t - t_0) until it is there."""
    goal = goal_of({"command_rate_limit": {"limit": 2.5}})
    since = ROW * (np.arange(120) - AT)
    np.testing.assert_allclose(goal, np.clip(2.5 * since, 0.0, JUMP), atol=2e-3)


def test_a_slow_command_does_not_feel_the_limit() -> None:
    """Below its speed a goal is the command itself; a staircase of rows is met within each row."""
    command = 0.5 * ROW * np.arange(100)
    free = run(command, None)
    held = run(command, {"command_rate_limit": {"limit": 100.0}})
    np.testing.assert_allclose(held["theta"][1:], free["theta"][:-1], atol=0.5 * ROW)


@pytest.mark.parametrize(
    ("limit", "speed"), [(10.0, 100.0), (30.0, 2.5), (8.0, 3.0)], ids=["triangle", "long", "short"]
)
def test_a_profile_is_a_trapezoid_of_speed(limit: float, speed: float) -> None:
    """Up at a to omega, or to sqrt(a x) where the way is short, and down again."""
    goal = goal_of({"acceleration_limit": {"limit": limit, "speed": speed}})
    top = min(speed, np.sqrt(limit * JUMP))
    rise, end = top / limit, JUMP / top + top / limit
    t = ROW * (np.arange(120) - AT)
    left = end - t
    expected = np.select(
        [t < 0.0, t < rise, left > rise, left > 0.0],
        [0.0, 0.5 * limit * t**2, top * (t - 0.5 * rise), JUMP - 0.5 * limit * left**2],
        JUMP,
    )
    np.testing.assert_allclose(goal, expected, atol=2e-3)


def test_a_profile_turns_round_on_its_way() -> None:
    """A command that comes back finds the goal moving: it brakes before it returns."""
    index = np.arange(200)
    command = np.where(index < AT, 0.0, np.where(index < AT + 20, JUMP, 0.0))
    out = run(command, {"acceleration_limit": {"limit": 8.0, "speed": 50.0}}, **WALL)
    goal = out["force"] / GAIN + out["theta"]
    turn = 0.25  # [s] after the jump: 2 rad/s, 0.25 rad; braking takes as long and as far again
    assert goal.max() == pytest.approx(2.0 * 0.5 * 8.0 * turn**2, abs=2e-3)
    # from 0.5 rad at rest back to 0 takes 2 sqrt(x / a)
    assert goal[AT + 40 + int(2.0 * np.sqrt(0.5 / 8.0) / ROW) + 1] == pytest.approx(0.0, abs=2e-3)


def test_a_least_duty_is_added_to_every_demand() -> None:
    """F = P e + u_0 F_max sign e, which the limit still bounds; no demand stays none."""
    command = np.repeat([0.0, 0.3, 2.0, 6.0], 40)
    out = run(command, {"starting_duty": {"duty": 0.05}}, **WALL)
    error = command - out["theta"]
    expected = np.where(error > 1e-12, np.minimum(GAIN * error + 0.05 * LIMIT, LIMIT), 0.0)
    np.testing.assert_allclose(out["force"], expected, atol=1e-9)


def test_an_overload_is_cut_after_its_time_and_stays_cut() -> None:
    """Above the threshold for T the force falls to the protective share; a short pull does not."""
    effect = {"overload_cut": {"duty": 0.3, "fraction": 0.1, "time": 0.5}}
    index = np.arange(240)
    command = np.where((index % 120) < AT, 0.0, JUMP)  # 0.4 of the limit, twice
    command[80:86] = 0.5  # a breath once it is cut is too late
    out = run(command, effect, **WALL)
    force = out["force"]
    cut = AT + round(0.5 / ROW)
    np.testing.assert_allclose(force[AT:cut], GAIN * (JUMP - out["theta"][AT:cut]), atol=1e-9)
    np.testing.assert_allclose(force[cut + 1 : 80], 0.1 * LIMIT, atol=1e-9)
    np.testing.assert_allclose(force[86:120], 0.1 * LIMIT, atol=1e-9)
    short = np.where((index % 40) < AT, 0.0, JUMP)  # 0.25 s at a time
    np.testing.assert_array_equal(run(short, effect, **WALL)["force"], run(short, **WALL)["force"])


def test_an_overload_is_cut_inside_a_step() -> None:
    """Steps of 2 ms err by 1 mrad where a held finger falls, by 12 if it falls at their ends."""
    index = np.arange(200)
    command = np.where(index < AT, 0.0, np.where(index < 150, JUMP, 0.3))
    effects = {
        "overload_cut": {"duty": 0.1, "fraction": 0.03, "time": 0.5013},
        "load_dependent_friction": {"coefficient": 0.2},
    }
    coarse, fine = (
        bench_simulate(commanded(command), effects, time_step=h, kernel=tuple(effects))
        for h in (2e-3, 1e-4)
    )
    np.testing.assert_allclose(coarse.motor_position, fine.motor_position, atol=1.2e-3)
    assert np.ptp(fine.motor_position[60:150]) > 0.3  # the finger falls


def test_a_demand_of_the_other_side_ends_the_protection() -> None:
    """A shaft is cut on the side of its overload, and free again once it was asked back.

    A heavy arm hardly moves, so that its gear carries what the motor gives.
    """
    index = np.arange(200)
    command = np.select([index < 100, index < 104], [JUMP, -0.2], JUMP)
    servo = {
        "duty_per_rad": 0.5, "max_duty": 1.0, "supply_voltage": 12.0, "torque_constant": 0.05,
        "resistance": 0.2, "armature": 0.1, "spool_radius": 1.0,
    }  # fmt: skip
    numbers = {"duty": 0.6, "fraction": 0.2, "time": 0.5}
    model = stated_model("pwm_servo", servo, {"overload_cut": numbers})
    heavy = BenchOverrides(mass=(100.0,), length=(1.0,), damping=(0.0,))
    run = run_of(command, bench="pendulum", start="first_row", bench_overrides=heavy)
    (out,) = simulate([run], model, time_step=5e-4)
    stall = 12.0 * 0.05 / 0.2
    for rows, duty in (((5, 40), 1.0), ((42, 100), 0.2), ((101, 104), -0.1), ((105, 140), 1.0)):
        given = out.force[slice(*rows), 0]
        np.testing.assert_allclose(given, duty * stall, atol=0.01)  # what the arm moved


def test_friction_of_two_sides_takes_each_on_its_way() -> None:
    """On a ramp up the winding force is lost, on the ramp down the other is held."""
    index = ROW * np.arange(400)
    command = 1.0 + index[-1] / 2.0 - np.abs(index - index[-1] / 2.0)
    out = run(command, {"asymmetric_friction": {"winding": 0.4, "unwinding": 0.9}})
    lost = GAIN * (command - out["theta"]) - out["force"]
    for side, level in ((1.0, 0.4), (-1.0, -0.9)):
        sliding = side * out["rate"] > 0.1
        assert sliding[60:].sum() > 20
        np.testing.assert_allclose(lost[60:][sliding[60:]], level, atol=1e-9)


def test_equal_sides_are_coulomb_friction() -> None:
    """Nothing else is in the law."""
    command = np.repeat([0.5, 3.0, 1.0, 4.0], 30)
    both = run(command, {"asymmetric_friction": {"winding": 0.7, "unwinding": 0.7}})
    one = run(command, {"coulomb_friction": {"force": 0.7}})
    np.testing.assert_allclose(both["theta"], one["theta"], atol=1e-12)


@pytest.mark.parametrize("exponent", [0.0, 0.5, 1.0, 2.0])
def test_hysteresis_is_dahls_law_along_the_way(exponent: float) -> None:
    """After a reversal at x_r: F_h = F_C s (1 - u), and u falls over the way as du/dw = -u^n."""
    force, travel = 0.8, 1e-3
    index = np.arange(400)
    command = 3.0 + 1.5 * np.sin(0.03 * index)
    values = {"force": force, "travel": travel, "exponent": exponent}
    out = run(command, {"hysteresis": values})
    lost = GAIN * (command - out["theta"]) - out["force"]
    way = RADIUS * out["theta"]
    turns = np.flatnonzero(np.diff(np.sign(np.diff(way)))) + 1
    for first, last in pairwise(turns):
        rows = slice(first + 1, last)
        side = np.sign(way[last] - way[first])
        gone = np.abs(way[rows] - way[first])
        start = 1.0 - side * lost[first] / force
        share = solve_ivp(
            lambda _, u: -(max(0.0, u[0]) ** exponent) * (u[0] > 0.0),
            (0.0, gone[-1] / travel), [start], t_eval=gone / travel, max_step=1e-2,
        ).y[0]  # fmt: skip
        expected = side * force * (1.0 - share)
        # the turn lies between two rows
        np.testing.assert_allclose(lost[rows], expected, atol=0.03)
    assert np.abs(lost).max() <= force * (1.0 + 1e-9)


@pytest.mark.parametrize("exponent", [0.0, 0.5, 1.0, 1.6, 2.0])
def test_the_slope_of_hysteresis_is_that_of_its_share(exponent, monkeypatch) -> None:
    """du/dw = -u^n by a central difference, as an implicit step takes it."""
    double = SimpleNamespace(abs=abs, exp=math.exp, pow=pow, max=max)
    monkeypatch.setattr(hysteresis, "wp", double)
    monkeypatch.setattr(hysteresis, "real", float)
    monkeypatch.setattr(hysteresis, "Jet", lambda *numbers: numbers or (0.0, 0.0, 0.0))
    left: Any = hysteresis.left
    for before, way in ((0.8, 0.3), (1.9, 0.2), (0.6, 0.0)):
        more, less = (left(before, way + by, exponent)[0] for by in (1e-4, -1e-4))
        share, slope, _ = left(before, way, exponent)
        assert slope == pytest.approx((less - more) / 2e-4, rel=1e-5)
        assert slope == pytest.approx(share**exponent)
    assert left(-0.1, 0.3, exponent)[1] == 0.0


def test_a_falling_rotor_loads_its_gear_on_its_own_side() -> None:
    """With the motor off a weight drives the rotor through the gear, whose friction helps to hold.

    Falling, m l^2 a + m g l sin q = -J a / (1 - c). Taken on the motor's side, which gives nothing,
    the gear would seem to be driven and lose in place of hold.
    """
    inertia, share, mass, length, angle = 0.02, 0.4, 0.5, 0.1, 1.2
    servo = {
        "duty_per_rad": 1.0, "max_duty": 1.0, "supply_voltage": 12.0, "torque_constant": 1.0,
        "resistance": 4.0, "armature": inertia, "spool_radius": 1.0,
    }  # fmt: skip
    friction = NamedValues(name="load_dependent_friction", values={"coefficient": share})
    model = Model(actuator=NamedValues(name="pwm_servo", values=servo), effects=(friction,))
    for side in (1.0, -1.0):
        fall = run_of(
            np.zeros(40), bench="pendulum", rate=1000.0, start="first_row", angle=side * angle
        )
        numbers = type(fall.bench_overrides)(mass=(mass,), length=(length,))
        fall = type(fall)(
            **{**vars(fall), "bench_overrides": numbers, "enabled": np.zeros(40, dtype=bool)}
        )
        (out,) = simulate([fall], model, time_step=2.5e-4)
        arm, weight = mass * length**2, mass * 9.81 * length * np.sin(side * angle)
        expected = -weight / (arm + inertia / (1.0 - share))
        speed = out.motor_velocity[20, 0]
        assert speed == pytest.approx(expected * out.time[20], rel=5e-3)
        # the load cell behind the gear carries what moves the arm
        assert out.force[10, 0] == pytest.approx(arm * expected + weight, rel=5e-3)
