"""Effects between command and mechanism, against numbers worked out by hand on the weak spring."""

from dataclasses import replace

import numpy as np
import pytest

from tests.effect_bench import GAIN, RADIUS, ROW, commanded, run, simulate, steps_and_waves
from tests.made import stated_model
from tests.physics.runs import simulate as simulate_models

STIFFNESS = 200.0  # [N/m] the weak spring
DAMPING = 5.0  # [N s/m]
WALL = {"stiffness": 1e6}
"""A spring that hardly moves (21 um under 21 N), so that the force alone is seen."""


def step(level: float, rows: int = 120, at: int = 20) -> np.ndarray:
    """A step from rest [rad]."""
    return np.where(np.arange(rows) < at, 0.0, level)


def ramp(rows: int = 400) -> np.ndarray:
    """Up at 1 rad/s and down again [rad], from 1 rad."""
    index = np.arange(rows) * ROW
    top = index[-1] / 2.0
    return 1.0 + top - np.abs(index - top)


def test_a_delay_of_two_rows_shifts_everything_by_two_rows() -> None:
    """theta_d(t - delay) is the same staircase, later."""
    command = steps_and_waves()
    prompt, late = run(command), run(command, {"command_delay": {"delay": 2 * ROW}})
    np.testing.assert_allclose(late["theta"][2:], prompt["theta"][:-2], atol=1e-12)
    np.testing.assert_allclose(late["force"][3:], prompt["force"][1:-2], atol=1e-9)


def test_a_delay_between_rows_acts_between_rows() -> None:
    """One and a half rows are three half rows of the staircase written twice as often."""
    command = steps_and_waves()
    late = run(command, {"command_delay": {"delay": 1.5 * ROW}})
    prompt = simulate(commanded(np.repeat(command, 2), row=0.5 * ROW)).motor_position[:, 0]
    np.testing.assert_allclose(late["theta"][2:], prompt[1:-3:2][: len(command) - 2], atol=1e-9)


@pytest.mark.parametrize(("scale", "most"), [(1.0, 2e-3), (1.13, 3e-3)])
def test_a_delayed_command_divides_a_substep(scale: float, most: float) -> None:
    """Steps of 2 ms err by 2 mrad where a finger jumps; a mean command would err by 69."""
    command = np.repeat([0.3, 5.0, 1.0, 3.5], 40)
    effects = {"command_delay": {"delay": 0.0207}, "sample_period_error": {"scale": scale}}
    coarse, fine = (
        simulate(commanded(command), effects, time_step=h, kernel=tuple(effects))
        for h in (2e-3, 1e-4)
    )
    np.testing.assert_allclose(coarse.motor_position, fine.motor_position, atol=most)


def test_lag_answers_a_step_with_its_time_constant() -> None:
    """Against a wall the force is P theta_d (1 - exp(-t / tau))."""
    out = run(step(2.0), {"actuator_lag": {"time_constant": 0.05}}, **WALL)
    since = out["time"][20:] - out["time"][20]
    expected = GAIN * 2.0 * (1.0 - np.exp(-since / 0.05))
    np.testing.assert_allclose(out["force"][20:], expected, rtol=2e-3, atol=1e-3)


def test_a_motor_fades_under_load_and_recovers_at_rest() -> None:
    """Against a wall the force follows tau rho' = kappa F^2 - rho, pulling, slack and again."""
    fade, tau = 0.03, 0.4
    command = np.concatenate([np.zeros(20), np.full(80, 2.0), np.zeros(40), np.full(60, 2.0)])
    out = run(command, {"torque_fade": {"fade": fade, "time_constant": tau}}, **WALL)
    rho, step, expected = 0.0, 1.0e-4, []
    rows = np.searchsorted(out["time"], np.arange(0.0, out["time"][-1], step), side="right") - 1
    for row in rows:
        force = GAIN * command[row] / (1.0 + rho)
        expected.append(force)
        rho += step / tau * (fade * force**2 - rho)
    last = np.searchsorted(rows, np.arange(len(command) - 1), side="right") - 1
    settled = np.flatnonzero(np.diff(command) == 0.0)[5:-1]  # a row past each jump
    measured = out["force"][settled + 1]
    np.testing.assert_allclose(measured, np.array(expected)[last][settled], rtol=5e-3, atol=5e-3)
    assert out["force"][25] > 1.2 * out["force"][98]
    assert out["force"][98] < out["force"][142] < out["force"][25]


def test_a_strongly_fading_motor_starts_settled_under_load() -> None:
    """F (1 + fade F^2) = P e from the first row on, on a wall and where the spring gives way."""
    fade = {"torque_fade": {"fade": 0.036, "time_constant": 1.3}}
    for bench in (WALL, {}):
        out = run(np.full(40, 4.0), fade, **bench)
        demand = GAIN * (4.0 - out["theta"])
        np.testing.assert_allclose(
            out["force"] * (1.0 + 0.036 * out["force"] ** 2), demand, rtol=1e-6
        )
        np.testing.assert_allclose(out["force"], out["force"][0], rtol=1e-6)


def test_force_obeys_the_law_of_its_effect_row_by_row() -> None:
    """F is a function of error and time alone for a servo without friction."""
    command = steps_and_waves()

    def limited(error: np.ndarray) -> np.ndarray:
        return np.clip(GAIN * error, -21.0, 21.0)

    laws = {
        "gain_error": ({"scale": 0.8}, lambda e, t: 0.8 * GAIN * e),
        "gain_drift": ({"rate": 0.02}, lambda e, t: GAIN * (1.0 - 0.02 * t) * e),
        "deadband": (
            {"width": 0.3},
            lambda e, t: GAIN * np.sign(e) * np.maximum(np.abs(e) - 0.3, 0),
        ),
        "force_saturation": ({"limit": 7.0}, lambda e, t: np.minimum(GAIN * e, 7.0)),
        "voltage_sag": ({"sag": 0.03}, lambda e, t: limited(e) / (1.0 + 0.03 * np.abs(limited(e)))),
    }
    for name, (values, law) in laws.items():
        out = run(command, {name: values})
        expected = np.maximum(law(command - out["theta"], out["time"]), 0.0)
        np.testing.assert_allclose(out["force"], expected, atol=1e-9, err_msg=name)


def test_a_motor_nears_its_limit_over_a_knee() -> None:
    """At the limit a share of knee times ln 2 is missing; far below and far above, nothing."""
    command = steps_and_waves()
    out = run(command, {"force_saturation": {"limit": 4.0, "knee": 0.1}})
    asked = GAIN * (command - out["theta"])
    left = 4.0 * (1.0 - 0.1 * np.logaddexp(0.0, (1.0 - np.abs(asked) / 4.0) / 0.1))
    expected = np.maximum(np.sign(asked) * np.maximum(left, 0.0), 0.0)
    np.testing.assert_allclose(out["force"], expected, atol=1e-9)
    assert np.abs(out["force"] - np.clip(asked, 0.0, 4.0)).max() > 0.2


@pytest.mark.parametrize("static", [0.7, 0.3])
def test_stribeck_with_one_level_is_coulomb(static: float) -> None:
    """A static force no greater than the Coulomb force leaves nothing of the exponential."""
    command = steps_and_waves()
    values = {"coulomb_force": 0.7, "static_force": static, "stribeck_velocity": 1.0}
    stribeck = run(command, {"stribeck_friction": values})
    coulomb = run(command, {"coulomb_friction": {"force": 0.7}})
    np.testing.assert_allclose(stribeck["theta"], coulomb["theta"], atol=1e-12)


@pytest.mark.parametrize("going", [1.0, -1.0])
def test_frictions_take_their_share_of_a_ramp(going: float) -> None:
    """In steady sliding each friction's force is its formula."""
    rows = slice(60, 190) if going > 0 else slice(260, 390)
    cases = {
        "viscous_friction": ({"coefficient": 0.8}, lambda m, w: m - 0.8 * w),
        "coulomb_friction": ({"force": 0.6}, lambda m, w: m - 0.6 * going),
        "stribeck_friction": (
            {"coulomb_force": 0.4, "static_force": 0.8, "stribeck_velocity": 1.0},
            lambda m, w: m - going * (0.4 + 0.4 * np.exp(-(w**2))),
        ),
        "load_dependent_friction": ({"coefficient": 0.2}, lambda m, w: m / (1.0 + 0.2 * going)),
        "holding_friction": ({"share": 0.3}, lambda m, w: m if going > 0 else m / 0.7),
    }
    command = ramp()
    for name, (values, law) in cases.items():
        out = run(command, {name: values})
        motor = GAIN * (command - out["theta"])
        sliding = out["rate"][rows] * going > 0.1
        assert sliding.sum() > 20  # the light slider sticks and slips
        expected = law(motor[rows], out["rate"][rows])[sliding]
        np.testing.assert_allclose(out["force"][rows][sliding], expected, atol=1e-9, err_msg=name)


@pytest.mark.parametrize("going", [1.0, -1.0])
def test_routing_loses_the_capstan_ratio(going: float) -> None:
    """The spring feels F exp(-mu) while the tendon winds in and F exp(mu) while it winds out."""
    fine = ROW / 20.0  # the reading just after a command is half a step of the ramp ahead
    index = np.arange(6000) * fine
    command = 3.0 - np.abs(index - 1.9)
    out = run(command, {"routing_friction": {"exponent": 0.2}}, row=fine)
    felt = STIFFNESS * out["travel"] + DAMPING * RADIUS * out["rate"]
    rows = (out["rate"] * going > 0.1) & (np.abs(index - 1.9 - 0.9 * going) > 0.6) & (index > 0.5)
    ratio = (felt / out["force"])[rows]
    assert ratio.mean() == pytest.approx(np.exp(-0.2 * going), rel=2e-3)


def test_the_motor_keeps_its_speed_limit_and_holds_while_unwinding() -> None:
    """|theta_dot| <= omega, reached on the way in and out, and tension on the way out."""
    command = np.concatenate([step(5.5, 80), np.full(80, 0.0)])
    out = run(command, {"speed_limit": {"limit": 6.0}})
    assert np.abs(out["rate"]).max() <= 6.0 * (1.0 + 1e-6)
    at_limit = np.abs(np.abs(out["rate"]) - 6.0) < 1e-5
    unwinding = at_limit & (out["rate"] < 0.0)
    assert (at_limit & (out["rate"] > 0.0)).sum() > 5
    assert unwinding.sum() > 5
    # nothing accelerates, so the tendon carries the spring less what its damper takes
    carried = np.maximum(STIFFNESS * out["travel"] + DAMPING * RADIUS * out["rate"], 0.0)
    np.testing.assert_allclose(out["force"][unwinding], carried[unwinding], rtol=1e-6)


@pytest.mark.parametrize("speed", [9.0, -9.0])
def test_a_motor_that_begins_too_fast_is_at_its_limit_at_once(speed: float) -> None:
    """Winding out, it stops its slider with an impulse; winding in, the string goes slack."""
    began = replace(
        commanded(np.full(20, 2.0)),
        motor_position=np.full((20, 1), 2.0),
        motor_velocity=np.full((20, 1), speed),
        start="first_row",
    )
    out = simulate(began, {"speed_limit": {"limit": 4.0}}, time_step=1e-3)
    rate, force = out.motor_velocity[:, 0], out.force[:, 0]
    assert rate[0] == pytest.approx(speed)
    if speed < 0.0:
        assert np.abs(rate[1:]).max() <= 4.0 * (1.0 + 1e-6)
    else:
        assert (force[np.abs(rate) > 4.0 * (1.0 + 1e-6)] == 0.0).all()
    assert force.max() < 21.0


def test_slack_is_dead_travel() -> None:
    """Taut: r theta = l + length. Slack: theta is the command and there is no force."""
    values = {"tendon_slack": {"length": 0.004}}
    taut = run(np.full(10, 2.0), values)
    theta = (GAIN * 2.0 + STIFFNESS * 0.004) / (GAIN + STIFFNESS * RADIUS)
    assert taut["theta"][-1] == pytest.approx(theta, rel=1e-9)
    assert taut["travel"][-1] == pytest.approx(RADIUS * theta - 0.004, rel=1e-9)
    slack = run(np.full(10, 0.2), values)
    assert slack["theta"][-1] == pytest.approx(0.2, abs=1e-9)
    assert slack["force"][-1] == 0.0


def test_a_compliant_tendon_adds_force_over_stiffness() -> None:
    """At rest r theta = l + F / k."""
    out = run(np.full(10, 3.0), {"tendon_compliance": {"stiffness": 5000.0}})
    stretch = out["force"] / 5000.0
    np.testing.assert_allclose(RADIUS * out["theta"], out["travel"] + stretch, rtol=1e-9)
    np.testing.assert_allclose(out["force"], GAIN * (3.0 - out["theta"]), rtol=1e-9)


def test_viscous_friction_loads_a_compliant_tendon_in_its_own_time() -> None:
    """Against a wall F grows with tau = (c / (k r)) / (1 + P / (k r))."""
    effects = {"tendon_compliance": {"stiffness": 5000.0}, "viscous_friction": {"coefficient": 2.0}}
    out = run(step(2.0), effects, **WALL)
    soft = 1.0 + GAIN / (5000.0 * RADIUS)
    tau = 2.0 / (5000.0 * RADIUS) / soft
    since = out["time"][20:] - out["time"][20]
    expected = GAIN * 2.0 / soft * (1.0 - np.exp(-since / tau))
    # the wall's own give of 5e-3 of the tendon's
    np.testing.assert_allclose(out["force"][20:], expected, rtol=1e-2, atol=2e-2)


def test_dry_friction_holds_the_spool_of_a_compliant_tendon() -> None:
    """The string carries the motor's force less friction: all of it while the spool turns."""
    effects = {"tendon_compliance": {"stiffness": 5000.0}, "coulomb_friction": {"force": 1.0}}
    command = ramp()
    out = run(command, effects)
    kept = GAIN * (command - out["theta"]) - out["force"]
    stretch = out["force"] / 5000.0
    np.testing.assert_allclose(RADIUS * out["theta"], out["travel"] + stretch, atol=1e-5)
    np.testing.assert_allclose(kept[150:199], 1.0, atol=0.01)
    np.testing.assert_allclose(kept[350:], -1.0, atol=0.01)
    stuck = np.flatnonzero(np.abs(kept) < 0.9)[1:]
    assert len(stuck) > 20
    assert np.ptp(out["theta"][stuck[stuck > 200]]) < 1e-4


@pytest.mark.parametrize(
    "friction",
    [
        {"coulomb_friction": {"force": 0.8}},
        {"hysteresis": {"force": 0.8, "travel": 3e-4, "exponent": 0.0}},
        {"load_dependent_friction": {"coefficient": 0.15}},
    ],
    ids=lambda friction: "".join(friction),
)
def test_a_spool_without_inertia_is_the_limit_of_a_light_one(friction) -> None:
    """Steps, ramps and waves of a rotor of 1 g cm2, whose spool has a coordinate of its own."""
    effects = {
        "tendon_compliance": {"stiffness": 6000.0},
        "viscous_friction": {"coefficient": 0.6},
        # those that sleep share one kernel
        "coulomb_friction": {"force": 0.0},
        "hysteresis": {"force": 0.0, "travel": 3e-4},
        "load_dependent_friction": {"coefficient": 0.0},
        **friction,
    }
    command = np.concatenate([steps_and_waves(), ramp(160)])
    found = {}
    for name, values in (
        ("ideal", {"gain": GAIN}),
        ("pd_torque", {"kp": GAIN * RADIUS, "kd": 0.0, "max_torque": 21.0 * RADIUS,
                       "armature": 1e-7, "spool_radius": RADIUS}),
    ):  # fmt: skip
        model = stated_model(name, values, effects)
        found[name] = simulate_models([commanded(command)], model, time_step=2e-4)[0]
    light, none = found["pd_torque"], found["ideal"]
    off = light.motor_position - none.motor_position
    assert np.sqrt(np.mean(off**2)) < 3e-4
    assert np.sqrt(np.mean((light.force - none.force) ** 2)) < 2e-3


@pytest.mark.parametrize("stiffness", [6e3, 5e4])
def test_a_sticking_spool_needs_no_shorter_steps(stiffness: float) -> None:
    """Steps of 2 ms err by 1 mrad, with dry friction alone: nothing else damps the string."""
    effects = {"tendon_compliance": {"stiffness": stiffness}, "coulomb_friction": {"force": 0.8}}
    recording = commanded(np.concatenate([steps_and_waves(), ramp(160)]))
    coarse, fine = (simulate(recording, effects, time_step=h) for h in (2e-3, 1e-4))
    off = coarse.motor_position - fine.motor_position
    assert np.sqrt(np.mean(off**2)) < 2e-3


def test_a_motor_that_turns_back_lets_a_compliant_tendon_go() -> None:
    """A slack string neither holds the mechanism by dry friction nor pushes it."""
    effects = {
        "tendon_compliance": {"stiffness": 5000.0},
        "coulomb_friction": {"force": 1.0},
        "viscous_friction": {"coefficient": 2.0},
    }
    command = np.concatenate([np.full(40, 3.0), np.full(80, -1.0)])
    out = run(command, effects)
    assert out["travel"][39] > 0.01
    assert out["force"][-1] == 0.0
    assert out["travel"][-1] == pytest.approx(0.0, abs=1e-9)


def test_a_larger_spool_turns_less() -> None:
    """The angle is l / (s r), with the gain in N/rad."""
    out = run(np.full(10, 3.0), {"spool_radius_error": {"scale": 1.2}})
    theta = GAIN * 3.0 / (GAIN + STIFFNESS * 1.2 * RADIUS)
    assert out["theta"][-1] == pytest.approx(theta, rel=1e-9)


def test_backlash_of_a_direct_drive_is_half_a_gap_either_way() -> None:
    """A pendulum held to one side rests on one flank, held to the other on the other."""
    for command in (0.6, -0.6):
        recording = commanded(np.full(10, command), "pendulum", mass=0.2, length=0.1)
        out = simulate(recording, {"backlash": {"width": 0.04}})
        gap = out.motor_position[-1, 0] - out.joint_position[-1, 0]
        assert gap == pytest.approx(np.sign(command) * 0.02, abs=1e-9)
        torque = GAIN * (command - out.motor_position[-1, 0])
        weight = 0.2 * 9.81 * 0.1 * np.sin(out.joint_position[-1, 0])
        assert torque == pytest.approx(weight, abs=1e-6)
