"""Friction by what presses a gear's teeth, against Rhoban/bam's own program and by hand.

The reference is bam_friction.json beside this file; lab/studies/bam_friction.py made it.
"""

import json
from collections.abc import Sequence
from dataclasses import replace
from math import asin
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tendon_hardware.virtual_bench.emulation.truth import quasi_static_gear
from tendon_newton.data.bench_overrides import BenchOverrides
from tendon_newton.data.model_file import Model, NamedValues
from tendon_newton.data.recording import Recording
from tendon_newton.effects import EFFECTS
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.simulation.hosts.replay import replay
from tendon_newton.simulation.hosts.rollout import Candidates, Rollout, Trajectory
from tests.effect_bench import GAIN, Chosen, commanded, run, simulate
from tests.made import stated_model
from tests.physics.runs import run_of

REFERENCE: dict[str, Any] = json.loads(Path(__file__).with_name("bam_friction.json").read_text())
LAWS: dict[str, dict[str, float]] = REFERENCE["laws"]
MASS, LENGTH, GRAVITY = 20.0, 0.5, 9.81
"""Of the arm on the shaft [kg], [m], [m/s2]; its weight balances up to 98 N m."""


def cases_of(law: str, *, at_rest: bool) -> list[tuple[float, float, float, float]]:
    """Return motor torque [N m], speed [rad/s], direction and the output [N m] of one law."""
    return [
        (motor, speed, direction, output)
        for name, motor, speed, direction, output in REFERENCE["rows"]
        if name == law and (speed == 0.0) == at_rest
    ]


def effects_of(law: str) -> Chosen:
    """Return what the program's numbers are here."""
    numbers = LAWS[law]
    if "load_friction_motor" in numbers:
        coefficient, gain = quasi_static_gear(
            numbers["load_friction_motor"], numbers["load_friction_external"]
        )
        return {
            "gain_error": {"scale": gain},
            "load_dependent_friction": {"coefficient": coefficient},
        }
    sliding = numbers["load_friction_base"]
    if "dtheta_stribeck" not in numbers:
        return {"gear_load_friction": {"coefficient": sliding}}
    return {
        "load_stribeck_friction": {
            "coefficient": sliding,
            "static_coefficient": sliding + numbers["load_friction_stribeck"],
            "stribeck_velocity": numbers["dtheta_stribeck"],
        }
    }


def shaft(motor: float, *, angle: float = 0.0, speed: float = 0.0) -> Recording:
    """Return a shaft with an arm, under a motor's torque [N m] when it begins."""
    numbers = BenchOverrides(mass=(MASS,), length=(LENGTH,))
    return run_of(
        np.full(2, angle + motor / GAIN),
        bench="pendulum",
        start="first_row",
        angle=angle,
        speed=speed,
        bench_overrides=numbers,
    )


def simulated(recordings: Sequence[Recording], effects: Chosen) -> list[Trajectory]:
    """Run shafts side by side in the kernel that holds the whole catalogue."""
    model = stated_model("ideal", {"gain": GAIN}, effects)
    every = Candidates(effects=tuple(EFFECTS))
    rollout = Rollout(load_mechanism("pendulum"), recordings, model, candidates=every)
    return rollout.run(rollout.base_vectors(model)[None])[0]


@pytest.mark.parametrize("law", LAWS)
def test_a_turning_gear_gives_what_their_program_gives(law: str) -> None:
    """Driving and driven, either way round, slow and fast (1e-9: their bisection's last digits)."""
    cases = cases_of(law, at_rest=False)
    out = simulated([shaft(m, speed=sign * speed) for m, speed, sign, _ in cases], effects_of(law))
    outputs = [trajectory.force[0, 0] for trajectory in out]
    np.testing.assert_allclose(outputs, [output for *_, output in cases], rtol=1e-9)


@pytest.mark.parametrize("law", LAWS)
def test_a_resting_gear_holds_what_their_program_holds(law: str) -> None:
    """Loads a thousandth inside their interval stay where they are; as far outside they move."""
    cases = cases_of(law, at_rest=True)
    pairs = [(cases[i], cases[i + 1]) for i in range(0, len(cases), 2)]
    shafts = []
    for (motor, _, _, least), (_, _, _, most) in pairs:
        assert least < most
        margin = 1e-3 * (most - least)
        for load in (least + margin, most - margin, least - margin, most + margin):
            angle = asin(load / (MASS * GRAVITY * LENGTH))
            shafts.append(shaft(motor, angle=angle))
    out = simulated(shafts, effects_of(law))
    moved = [t.joint_position[-1, 0] - t.joint_position[0, 0] for t in out]
    assert np.all(np.sign(np.abs(moved)) == np.tile([0.0, 0.0, 1.0, 1.0], len(pairs)))
    assert np.all(np.sign(moved[2::4]) == 1.0)
    assert np.all(np.sign(moved[3::4]) == -1.0)


def test_equal_friction_on_both_sides_is_the_gear_s_law() -> None:
    """K on both sides is mu = 2 K / (1 + K^2) on a motor of (1 - K^2) / (1 + K^2) of its force."""
    waves = commanded(2.5 + 1.5 * np.sin(0.05 * np.arange(160)))
    waves = replace(waves, start="first_row")  # the rest of a weaker motor lies elsewhere
    coefficient, gain = quasi_static_gear(0.2, 0.2)
    assert coefficient == pytest.approx(0.4 / 1.04, rel=1e-12)
    assert gain == pytest.approx(0.96 / 1.04, rel=1e-12)
    gear = simulate(waves, {"gear_load_friction": {"coefficient": 0.2}})
    load = {"coefficient": coefficient}
    same = simulate(waves, {"gain_error": {"scale": gain}, "load_dependent_friction": load})
    np.testing.assert_allclose(gear.motor_position, same.motor_position, atol=1e-9)
    np.testing.assert_allclose(gear.force, same.force, atol=1e-8)


def test_breakaway_at_the_sliding_share_is_the_gear_s_law() -> None:
    """Nothing is left of the exponential."""
    command = 2.5 + 1.5 * np.sin(0.05 * np.arange(160))
    gear = run(command, {"gear_load_friction": {"coefficient": 0.2}})
    values = {"coefficient": 0.2, "static_coefficient": 0.2, "stribeck_velocity": 1.0}
    same = run(command, {"load_stribeck_friction": values})
    np.testing.assert_allclose(gear["theta"], same["theta"], atol=1e-12)


def test_a_gear_beside_dry_friction_adds_to_it() -> None:
    """F = F_m - s (C + K |F_m + F|) while it slides, either way, driving and driven."""
    values = {"coulomb_friction": {"force": 0.6}, "gear_load_friction": {"coefficient": 0.2}}
    cases = [(motor, sign) for motor in (-5.0, 0.1, 2.0, 9.0) for sign in (1.0, -1.0)]
    out = simulated([shaft(motor, speed=sign) for motor, sign in cases], values)
    for (motor, sign), trajectory in zip(cases, out, strict=True):
        force = trajectory.force[0, 0]
        assert force == pytest.approx(motor - sign * (0.6 + 0.2 * abs(motor + force)), rel=1e-9)


def test_a_rotor_s_gear_carries_a_string_that_pulls_however_little() -> None:
    """F_m = C + (1 + mu) F while a slow ramp winds in against less than dry friction takes."""
    constant, resistance, supply, radius, dry, share = 1.43, 15.0, 9.0, 0.0125, 1.2, 0.3
    servo = {
        "duty_per_rad": 0.1, "max_duty": 0.2, "supply_voltage": supply, "torque_constant": constant,
        "resistance": resistance, "armature": 0.0025, "spool_radius": radius,
    }  # fmt: skip
    chosen = {
        "coulomb_friction": {"force": dry},
        "load_dependent_friction": {"coefficient": share},
        "tendon_compliance": {"stiffness": 1.0e4},
    }
    effects = tuple(NamedValues(name=name, values=values) for name, values in chosen.items())
    model = Model(actuator=NamedValues(name="pwm_servo", values=servo), effects=effects)
    (out,) = replay([run_of(0.3 * np.arange(240) / 80.0, bench="spring_weak")], model)
    error = 0.3 * out.time[:-1] - out.motor_position[1:, 0]  # of the command until then
    emf = constant * out.motor_velocity[1:, 0]
    motor = constant / (resistance * radius) * (supply * 0.1 * error - emf)
    slow = (out.time[1:] > 1.5) & (out.motor_velocity[1:, 0] > 0.02)
    tension = out.force[1:, 0]
    assert np.count_nonzero(slow) > 40
    assert 0.05 < tension[slow].min() < tension[slow].max() < dry
    np.testing.assert_allclose(motor[slow], dry + (1.0 + share) * tension[slow], atol=0.02)
