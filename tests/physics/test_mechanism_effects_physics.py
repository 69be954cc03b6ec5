"""Effects on the mechanism's side, against numbers worked out by hand on the weak spring."""

import numpy as np
import pytest

from tests.effect_bench import GAIN, RADIUS, ROW, commanded, run, simulate, steps_and_waves

STIFFNESS = 200.0  # [N/m] the weak spring
DAMPING = 5.0  # [N s/m]
MASS = 0.05  # [kg]
TRAVEL = 0.08  # [m]


@pytest.mark.parametrize(
    ("effect", "number", "nominal"),
    [
        ("joint_stiffness_error", "stiffness", STIFFNESS),
        ("joint_damping_error", "damping", DAMPING),
        ("inertia_error", "mass", MASS),
    ],
)
def test_a_scale_is_another_number_of_the_bench(effect: str, number: str, nominal: float) -> None:
    """On a level rail a factor of 1.5 is a bench built so."""
    command = steps_and_waves()
    scaled = run(command, {effect: {"scale": 1.5}})
    built = run(command, **{number: 1.5 * nominal})
    # Newton keeps the bench's numbers in float32
    np.testing.assert_allclose(scaled["theta"], built["theta"], atol=1e-6)
    np.testing.assert_allclose(scaled["force"], built["force"], atol=1e-5)


def test_added_inertia_has_no_weight() -> None:
    """A finger at rest does not change its pose."""
    recording = commanded(np.full(5, 2.0), "finger")
    light, heavy = simulate(recording), simulate(recording, {"inertia_error": {"scale": 3.0}})
    np.testing.assert_allclose(heavy.joint_position, light.joint_position, atol=1e-9)


@pytest.mark.parametrize("angle", [0.4, -0.4])
def test_a_tipped_rail_pulls_with_the_weight_along_it(angle: float) -> None:
    """At rest k x = F + m g sin(alpha): a positive angle helps the tendon."""
    out = run(np.full(10, 2.0), {"gravity_misalignment": {"angle": angle}})
    weight = MASS * 9.81 * np.sin(angle)
    np.testing.assert_allclose(STIFFNESS * out["travel"], out["force"] + weight, rtol=1e-6)


def test_a_tipped_finger_feels_gravity_turned() -> None:
    """Tipped down by a right angle the straight finger hangs: its weight has no moment."""
    recording = commanded(np.zeros(5), "finger")
    out = simulate(recording, {"gravity_misalignment": {"angle": 0.5 * np.pi}})
    np.testing.assert_allclose(out.joint_position, 0.0, atol=1e-9)
    level = simulate(recording)
    assert level.joint_position.min() > 0.01


def test_a_stiffening_spring_is_cubic() -> None:
    """F = k x (1 + beta (x / x_max)^2) at rest."""
    out = run(np.full(10, 4.0), {"spring_stiffening": {"beta": 0.8}})
    x = out["travel"]
    np.testing.assert_allclose(
        out["force"], STIFFNESS * x * (1.0 + 0.8 * (x / TRAVEL) ** 2), rtol=1e-6
    )


def test_an_obstruction_takes_what_lies_behind_it() -> None:
    """F = k x + k_o (x - theta_0 r) at rest, and nothing before it."""
    values = {"obstruction": {"stiffness": 900.0, "position": 1.2}}
    behind = run(np.full(10, 4.0), values)
    depth = behind["travel"] - 1.2 * RADIUS
    assert depth.min() > 0.0
    np.testing.assert_allclose(
        behind["force"], STIFFNESS * behind["travel"] + 900.0 * depth, rtol=1e-6
    )
    before = run(np.full(10, 1.0), values)
    np.testing.assert_allclose(before["theta"], run(np.full(10, 1.0))["theta"], atol=1e-12)


def test_an_obstruction_takes_more_on_the_way_in_than_it_gives_back() -> None:
    """F = k x + c v + k_o d (1 + chi v) while the depth d grows, and as it shrinks."""
    fine, stiffness, place, chi = ROW / 20.0, 900.0, 1.2, 20.0
    index = np.arange(9600) * fine
    command = np.clip(4.0 - np.abs(index - 3.0), 1.5, 4.0)
    values = {"stiffness": stiffness, "position": place, "dissipation": chi}
    out = run(command, {"obstruction": values}, row=fine)
    speed = RADIUS * out["rate"]
    extra = out["force"] - STIFFNESS * out["travel"] - DAMPING * speed
    depth = out["travel"] - place * RADIUS
    for way, begin, end in ((1.0, 1.5, 3.0), (-1.0, 4.2, 4.6)):
        chosen = (way * out["rate"] > 0.1) & (index > begin) & (index < end) & (depth > 5e-4)
        assert np.count_nonzero(chosen) > 100
        lost = extra[chosen] / (stiffness * depth[chosen]) - 1.0
        np.testing.assert_allclose(lost, chi * speed[chosen], rtol=2e-2)


def test_dry_joints_hold_their_share_of_the_spring() -> None:
    """Sliding, the tendon carries f k x_max more or less than the spring; then it holds still."""
    fine = ROW / 20.0  # the reading just after a command is half a step of the ramp ahead
    index = np.arange(9600) * fine
    command = np.clip(4.0 - np.abs(index - 3.0), 1.5, 4.0)
    out = run(command, {"joint_dry_friction": {"fraction": 0.05}}, row=fine)
    extra = out["force"] - STIFFNESS * out["travel"] - DAMPING * RADIUS * out["rate"]
    inward = (out["rate"] > 0.1) & (index > 1.5) & (index < 3.0)
    outward = (out["rate"] < -0.1) & (index > 4.2) & (index < 5.5)
    assert extra[inward].mean() == pytest.approx(0.05 * STIFFNESS * TRAVEL, rel=2e-2)
    assert extra[outward].mean() == pytest.approx(-0.05 * STIFFNESS * TRAVEL, rel=2e-2)
    assert np.ptp(out["travel"][-300:]) == 0.0


def test_a_maxwell_branch_relaxes_with_its_time_constant() -> None:
    """After a step the creep decays with tau (k' + rho k) / k', where k' = k + P / r."""
    ratio, tau = 0.5, 0.3
    values = {"stiffness_ratio": ratio, "relaxation_time": tau}
    command = np.where(np.arange(400) < 10, 0.5, 2.0)
    out = run(command, {"viscoelastic_spring": values})
    held = STIFFNESS + GAIN / RADIUS
    final = GAIN * 2.0 / held
    late = (out["time"] > 0.4) & (out["time"] < 1.5)
    slope = np.polyfit(out["time"][late], np.log(final - out["travel"][late]), 1)[0]
    # the damper's c / k' = 9 ms is left out of the formula
    assert -1.0 / slope == pytest.approx(tau * (held + ratio * STIFFNESS) / held, rel=2e-2)


SMOOTH = {
    "actuator_lag": {"actuator_lag": {"time_constant": 0.03}},
    "viscoelastic_spring": {
        "viscoelastic_spring": {"stiffness_ratio": 0.8, "relaxation_time": 0.02}
    },
    "compliance and viscous friction": {
        "tendon_compliance": {"stiffness": 3000.0},
        "viscous_friction": {"coefficient": 1.0},
    },
}


@pytest.mark.parametrize("case", SMOOTH)
def test_effects_with_memory_keep_the_second_order(case: str) -> None:
    """Halving the step divides the error by four: taut, off the stops, under smooth commands."""
    index = np.arange(60)
    recording = commanded(2.5 + 0.8 * np.sin(index * 0.1))
    angles = {
        divisions: simulate(recording, SMOOTH[case], time_step=ROW / divisions).motor_position
        for divisions in (8, 16, 256)
    }
    coarse, fine = (
        np.sqrt(np.mean((angles[divisions] - angles[256]) ** 2)) for divisions in (8, 16)
    )
    assert np.log2(coarse / fine) > 1.8
