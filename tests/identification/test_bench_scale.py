"""Ranges, typical values, floors and units follow the bench and what its recordings show."""

from dataclasses import replace

import numpy as np
import pytest

from tendon_newton.actuators import ACTUATORS
from tendon_newton.data.bench_overrides import BenchOverrides
from tendon_newton.data.model_file import Model, NamedValues
from tendon_newton.data.parameters import DIMENSIONS, ON_A_SHAFT, BenchScale, Parameter
from tendon_newton.data.recording import Array, Recording
from tendon_newton.diagnosis.search.floors import form_scales
from tendon_newton.diagnosis.search.rule import FORM_FORCE, FORM_THETA
from tendon_newton.effects import EFFECTS
from tendon_newton.identification.bench_scale import SPARE, scale_of
from tendon_newton.mechanisms.geometry.overrides import override_mechanism
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.simulation.model.parameter_table import ParameterTable
from tests.effect_bench import GAIN, RADIUS, commanded, steps_and_waves
from tests.made import stated_model

OF_A_MOTOR = {"V", "ohm", "N m/A", "N m", "N m/rad", "N m s/rad"}
"""Units of a motor's own numbers. Their ranges hold motors of any size, so no bench moves them."""
WITHOUT_DIMENSION = {"1", "s", "1/s", *OF_A_MOTOR}


def model(radius: float | None = None, **values: float) -> Model:
    """The ideal source, or another gain or spool."""
    numbers: dict[str, float | str] = {"gain": GAIN, **values}
    if radius is not None:
        numbers["spool_radius"] = radius
    return stated_model("ideal", numbers)


def moved(bench: str, angle: Array, force: Array | None, **numbers: float) -> Recording:
    """A recording with a motion [rad] and its force [N]."""
    bare = commanded(angle, bench, **numbers)
    return replace(
        bare, motor_position=angle[:, None], force=None if force is None else force[:, None]
    )


def found(recording: Recording, model: Model) -> BenchScale:
    """The scale of one recording."""
    bench = override_mechanism(load_mechanism(recording.bench), recording.bench_overrides)
    return scale_of([bench], [recording], model)


WAVE = steps_and_waves()


@pytest.mark.parametrize("radius", [None, 0.0125, RADIUS])
@pytest.mark.parametrize("bench", ["finger", "finger_routed", "spring_weak", "spring_strong"])
def test_on_the_nominal_benches_every_range_is_as_declared(bench, radius) -> None:
    """To the bit, with a load cell, with a strong one, without one, and gently pulled."""
    for force in (GAIN * np.clip(WAVE, 0.0, 5.0), 1.2 * np.minimum(GAIN * WAVE, 21.0), None):
        assert found(moved(bench, 0.4 * WAVE, force), model(radius)) == BenchScale()
    assert found(moved(bench, 0.1 * WAVE, 0.7 * WAVE), model(radius)) == BenchScale()
    table = ParameterTable(actuator="ideal", effects=tuple(EFFECTS), scale=BenchScale())
    declared = [p for effect in EFFECTS.values() for p in effect.parameters]
    assert [p for _, p in table.owners][1:] == declared


def test_a_cart_in_metres_and_newtons_has_the_ranges_of_a_cart() -> None:
    """Forces of 150 N, 0.34 m of rail, one metre a radian: 240 N s/m is an ordinary number."""
    ramp = np.linspace(0.1, 0.44, len(WAVE))
    cart = moved("spring_weak", ramp, 150.0 * np.sin(WAVE), mass=95.0, stiffness=0.0, range=2.0)
    scale = found(cart, model(radius=1.0))
    assert scale.force == pytest.approx(SPARE * 150.0 / 21.0, rel=1e-2)
    assert scale.travel == pytest.approx(2.0 / 0.08, rel=1e-5)
    assert scale.turn == pytest.approx(0.0125)
    by_name = {
        (o, p.name): p
        for o, p in ParameterTable(actuator="ideal", effects=tuple(EFFECTS), scale=scale).owners
    }
    viscous = by_name["viscous_friction", "coefficient"]
    assert viscous.nominal / 10.0 < 240.0 < 10.0 * viscous.nominal
    assert by_name["coulomb_friction", "force"].upper > 150.0
    assert by_name["gravity_misalignment", "angle"].upper == 1.6
    assert by_name["command_delay", "delay"].upper == 0.4
    assert form_scales(scale).force == pytest.approx(FORM_FORCE * scale.force)
    assert form_scales(scale).theta == pytest.approx(FORM_THETA * 0.0125)  # 38 um


def test_a_shaft_s_torques_have_the_ranges_and_the_unit_of_torques() -> None:
    """Of 0.5 N m at most, measured or asked of the motor, 10 mN m of friction are ordinary."""
    measured = found(moved("pendulum", WAVE, 0.5 * np.sin(WAVE)), model())
    asked = found(commanded(0.125 * np.sin(WAVE), "pendulum"), model())
    for scale in (measured, asked):
        assert scale.is_shaft
        assert scale.force == pytest.approx(SPARE * 0.5 / 21.0, rel=0.06)
        assert (scale.travel, scale.turn) == (1.0, 1.0)
        dry, viscous = (
            EFFECTS[name].parameters[0].on(scale)
            for name in ("coulomb_friction", "viscous_friction")
        )
        assert (dry.unit, viscous.unit) == ("N m", "N m s/rad")
        assert dry.nominal / 10.0 < 0.01 < 10.0 * dry.nominal
        assert form_scales(scale).force < 0.01


def test_a_motor_s_greatest_torque_is_that_of_its_circuit() -> None:
    """Full duty of 7.4 V, 3.4 ohm and 0.4 N m/A: 0.87 N m, however far the command is."""
    values: dict[str, float | str] = {
        "duty_per_rad": 1.0, "max_duty": 1.0, "supply_voltage": 7.4, "torque_constant": 0.4,
        "resistance": 3.4, "armature": 0.002,
    }  # fmt: skip
    servo = stated_model("pwm_servo", values)
    scale = found(commanded(WAVE, "pendulum"), servo)
    assert scale.force == pytest.approx(SPARE * 0.4 * 7.4 / 3.4 / 21.0, rel=1e-5)
    assert scale.force_unit == "N m"


def test_a_strong_finger_is_as_strong_as_its_asset_says() -> None:
    """A limit of 60 N that the forces reach for is the scale of the forces."""
    finger = load_mechanism("finger")
    strong = replace(finger, tendons=(replace(finger.tendons[0], force_limit=60.0),))
    scale = scale_of([strong], [moved("finger", 0.3 * WAVE, 10.0 * WAVE)], model())
    assert scale == BenchScale(force=2.85714)  # 60 / 21, to six digits


def test_every_number_s_unit_is_known_to_grow_with_the_bench_or_not() -> None:
    """No unit is left out of both lists, and every one with a force changes on a shaft."""
    declared = [p for owner in (*EFFECTS.values(), *ACTUATORS.values()) for p in owner.parameters]
    for parameter in declared:
        assert (parameter.unit in DIMENSIONS) != (parameter.unit in WITHOUT_DIMENSION)
        if DIMENSIONS.get(parameter.unit, (0,))[0] and parameter.unit != "kg m2":
            assert parameter.unit in ON_A_SHAFT


def test_a_range_holds_what_a_model_states() -> None:
    """A number outside its range is no number to be cut."""
    parameter = Parameter(
        name="gain", unit="N/rad", null=0.0, nominal=4.0, lower=1.0, upper=10.0, source="test"
    )
    assert parameter.holding(50.0).upper == 50.0
    assert parameter.holding(0.5).lower == 0.5
    assert parameter.holding(3.0) == parameter


def test_numbers_of_a_large_machine_stand_in_a_model_file() -> None:
    """240 N s/m and 5,000 N/m are read; a million times a finger's friction is a slip."""
    table = ParameterTable(actuator="ideal", effects=("viscous_friction",))
    cart = replace(
        model(gain=5000.0),
        effects=(NamedValues(name="viscous_friction", values={"coefficient": 240.0}),),
    )
    assert table.vector(cart)[:2].tolist() == [5000.0, 240.0]
    assert EFFECTS["viscous_friction"].parameters[0].widest == (0.0, 2e5)
    assert EFFECTS["gravity_misalignment"].parameters[0].widest == (-1.6, 1.6)


def test_overrides_of_a_recording_count() -> None:
    """The range that a recording states is that of the tendon's travel."""
    ramp = np.linspace(0.0, 20.0, len(WAVE))
    long = moved("spring_weak", ramp, WAVE, range=0.4)
    assert long.bench_overrides == BenchOverrides(range=(0.4,))
    assert found(long, model()).travel == pytest.approx(5.0, rel=1e-5)
