"""Bristles under all dry friction, against laws with bristles of their own and closed forms."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Array
from tendon_newton.simulation.hosts.replay import replay
from tests.made import stated_model
from tests.physics.runs import DATA_SHEET, GAIN, RADIUS, held_run, run_of, simulate

TRAVEL = 3.0e-4  # m
SPRING = 200.0  # N/m: of the bench spring_weak
WAVES = 0.6 + 0.4 * np.sin(np.linspace(0.0, 20.0, 240)) * np.linspace(1.0, 0.2, 240)
STEPS = np.repeat([0.1, 0.8, 0.3, 0.5], 40)
RUNS = [run_of(command, bench="spring_weak") for command in (WAVES, STEPS)]
SERVOS = {
    "ideal": {"gain": GAIN, "spool_radius": RADIUS},
    "pwm_servo": DATA_SHEET,
    "pd_torque": {"kp": GAIN * RADIUS, "kd": 2e-4, "max_torque": 0.26, "armature": 1e-6,
                  "spool_radius": RADIUS},
}  # fmt: skip
ALIKE = 2.0e-5  # rad: a hundredth of an encoder's count


def model_of(actuator: str, effects: dict[str, dict[str, float]]) -> Model:
    """Return a servo without a rotor, or one whose spool has a coordinate of its own."""
    return stated_model(actuator, dict(SERVOS[actuator]), effects)


@pytest.mark.parametrize("bench", ["spring_weak", "finger", "pendulum"])
@pytest.mark.parametrize("actuator", ["ideal", "pwm_servo"])
def test_one_constant_friction_with_bristles_is_dahls(actuator: str, bench: str) -> None:
    """Two laws of one friction: along a string, in a hand's chain, at a shaft, with a rotor."""
    angles = []
    for friction in (
        {"hysteresis": {"force": 0.8, "travel": TRAVEL, "exponent": 1.0},
         "coulomb_friction": {"force": 0.0}, "presliding": {"travel": 0.0}},
        {"hysteresis": {"force": 0.0, "travel": TRAVEL, "exponent": 1.0},
         "coulomb_friction": {"force": 0.8}, "presliding": {"travel": TRAVEL}},
    ):  # fmt: skip
        model = model_of(actuator, friction)
        runs = [run_of(command, bench=bench) for command in (WAVES, STEPS)]
        out = simulate(runs, model, time_step=2.5e-4)
        angles.append(np.concatenate([t.motor_position[:, 0] for t in out]))
    assert np.ptp(angles[0]) > 0.05
    np.testing.assert_allclose(angles[1], angles[0], atol=ALIKE)


@pytest.mark.parametrize("actuator", ["ideal", "pwm_servo"])
def test_gear_and_guides_bend_by_one_share(actuator: str) -> None:
    """F = F_m - 0.9 z, or 0.5 z where it gives way, and exp(-0.3 z) behind the load cell.

    z is integrated along the way that was measured. The spring takes what the guides let through,
    to 0.05 N: a turn lies between two rows.
    """
    wrap = 0.3
    friction = {
        "asymmetric_friction": {"winding": 0.9, "unwinding": 0.5},
        "presliding": {"travel": TRAVEL},
        "routing_friction": {"exponent": wrap},
    }
    command = 1.2 + 0.5 * np.sin(0.003 * np.arange(4000))
    run = run_of(command, bench="spring_weak", rate=400.0)
    (out,) = simulate([run], model_of(actuator, friction), time_step=2.5e-4)
    angle, force = out.motor_position[:, 0], out.force[:, 0]
    carried = SPRING * out.joint_position[:, 0]
    through = carried / force
    share = shares_along(RADIUS * angle, -np.log(through[0]) / wrap)
    assert np.ptp(share) > 1.5
    np.testing.assert_allclose(carried, force * np.exp(-wrap * share), atol=0.05)
    if actuator == "ideal":
        lost = GAIN * (command - angle) - force
        np.testing.assert_allclose(lost, np.where(share > 0.0, 0.9, 0.5) * share, atol=0.05)


def shares_along(place: Array, begun: float) -> Array:
    """Return the share of bristles along a way [m], by that at its start."""
    turns = [0, *np.flatnonzero(np.diff(np.sign(np.diff(place)))) + 1, len(place) - 1]
    share = np.full(len(place), begun)
    for first, last in pairwise(turns):
        way = np.abs(place[first : last + 1] - place[first])
        side = np.sign(place[last] - place[first])
        if way[-1] > 0.0:
            rate = lambda _, z, side=side: (side - z) / TRAVEL  # noqa: E731
            share[first : last + 1] = solve_ivp(
                rate, (0.0, way[-1]), [share[first]], t_eval=way, max_step=TRAVEL / 10.0
            ).y[0]
    return share


@pytest.mark.parametrize("actuator", ["ideal", "pwm_servo"])
def test_short_bristles_are_friction_that_sticks(actuator: str) -> None:
    """With bristles of 2 um angles are those of Coulomb's law to 2 mrad, ten of their travels."""
    friction = {"coulomb_friction": {"force": 0.8}, "routing_friction": {"exponent": 0.1}}
    found = [
        np.concatenate([t.motor_position for t in simulate(RUNS, model, time_step=5e-4)])
        for travel in (0.0, 2.0e-6)
        for model in [model_of(actuator, {**friction, "presliding": {"travel": travel}})]
    ]
    np.testing.assert_allclose(found[1], found[0], atol=2.0e-3)


@pytest.mark.parametrize("actuator", ["ideal", "pd_torque"])
def test_bristles_that_hold_a_servo_are_bent_where_its_log_begins(actuator: str) -> None:
    """The longer log that it was cut from went on in the same way."""
    friction = {"coulomb_friction": {"force": 0.3}, "presliding": {"travel": TRAVEL}}
    model = model_of(actuator, friction)
    measured = held_run(model, "spring_weak")
    (held,) = replay([measured], model)
    np.testing.assert_allclose(held.motor_position, measured.motor_position, atol=2.0e-4)
