"""What a plant file says of the gear, against the gear itself."""

import tomllib
from dataclasses import replace
from pathlib import Path

import pytest

from tendon_hardware.benches.bench_address import BenchAddress
from tendon_hardware.virtual_bench.emulation.truth import (
    actuator_effects,
    quasi_static_gear,
    sensor_effects,
    write_plant_file,
)
from tendon_hardware.virtual_bench.physics.constants import ServoConstants
from tendon_hardware.virtual_bench.physics.motor import Motor
from tendon_hardware.virtual_bench.physics.tendon import BenchTendon
from tendon_hardware.virtual_bench.physics.unit import BENCHES, BenchUnit, draw_unit
from tendon_hardware.virtual_bench.physics.wear import (
    NEW,
    PLANTINGS,
    SLIP,
    plant_causes,
    planted_causes,
    worn,
)
from tendon_hardware.virtual_bench.process import (
    InvalidVirtualBench,
    lockstep_of,
    parse_wear,
    parse_word,
)
from tendon_newton.errors import UnknownName

SPEED = 0.8  # [rad/s] so fast that nothing is left of what holds at rest


def forces(servo: ServoConstants, duty: float, direction: float) -> tuple[float, float]:
    """Return the motor's force and the tension that balances it at a constant speed [N]."""
    low, high = 0.0, 100.0
    motor = Motor(servo)
    for _ in range(60):
        tension = 0.5 * (low + high)
        motor.enabled, motor.rate, motor.duty = True, direction * SPEED, duty
        motor.voltage = motor.supply
        motor.temperature = 25.0
        before = motor.rate
        motor.advance(tension, 1e-6)
        if motor.rate > before:
            low = tension
        else:
            high = tension
    return motor.current * servo.torque_constant / servo.spool_radius, 0.5 * (low + high)


def true_effects() -> dict[str, dict[str, float]]:
    """Return what the plant file of unit 0 says of the servo."""
    return dict(actuator_effects(draw_unit("finger", 0)))


def test_the_load_friction_of_a_plant_file_is_what_a_model_of_one_load_would_find() -> None:
    """Unit 0: 0.50 on a motor of 0.86 its force; its tendon's part alone would be 0.24."""
    truth = true_effects()
    assert truth["load_dependent_friction"]["coefficient"] == pytest.approx(0.50, abs=5e-3)
    assert truth["gain_error"]["scale"] == pytest.approx(0.86, abs=5e-3)
    assert draw_unit("finger", 0).servo.tendon_load_friction == pytest.approx(0.24, abs=5e-3)


@pytest.mark.parametrize("duty", [0.2, 0.5])
@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_the_gear_gives_what_its_plant_file_says(duty: float, direction: float) -> None:
    """Driving and driven, the balance is g F_m / (1 + s mu) (1e-3: one step's inertia)."""
    truth = true_effects()
    bare = replace(draw_unit("finger", 0).servo, dry_friction=0.0, viscous_friction=0.0)
    motor, tension = forces(bare, duty, direction)
    gain, load = truth["gain_error"]["scale"], truth["load_dependent_friction"]["coefficient"]
    assert tension == pytest.approx(gain * motor / (1.0 + direction * load), rel=1e-3)


def test_dry_friction_before_the_load_is_that_of_both_directions_mean() -> None:
    """C' is C (1 + s c_m) / (1 + c_m c_e) on the side s; the file has the mean."""
    servo = draw_unit("finger", 0).servo
    bare = replace(servo, viscous_friction=0.0)
    mu, gain = quasi_static_gear(servo.motor_load_friction, servo.tendon_load_friction)
    found = []
    for direction in (1.0, -1.0):
        motor, tension = forces(bare, 0.5, direction)
        found.append(direction * (gain * motor - (1.0 + direction * mu) * tension))
    dry = true_effects()["stribeck_friction"]["coulomb_force"]
    assert found[0] / found[1] == pytest.approx(
        (1.0 + servo.motor_load_friction) / (1.0 - servo.motor_load_friction), rel=1e-2
    )
    assert sum(found) / 2.0 == pytest.approx(dry, rel=1e-2)  # of forces of 10 N


def test_viscous_friction_is_what_a_model_with_the_motors_own_constants_lacks() -> None:
    """The back-EMF belongs to the motor; of the gear's grease it is both directions' mean."""
    servo, truth = replace(draw_unit("finger", 0).servo, dry_friction=0.0), true_effects()
    mu, gain = quasi_static_gear(servo.motor_load_friction, servo.tendon_load_friction)
    found = []
    for direction in (1.0, -1.0):
        motor, tension = forces(servo, 0.5, direction)
        found.append(direction * (gain * motor - (1.0 + direction * mu) * tension))
    drag = truth["viscous_friction"]["coefficient"] * SPEED
    assert sum(found) / 2.0 == pytest.approx(drag, rel=2e-2)  # of forces of 10 N


@pytest.mark.parametrize("bench", BENCHES)
def test_a_new_unit_is_the_drawn_one(bench: str) -> None:
    """To the last bit, and it is what one gets without a word about wear."""
    assert worn(draw_unit(bench, 3), NEW) == draw_unit(bench, 3)
    assert lockstep_of(f"virtual:{bench}:3").unit == draw_unit(bench, 3)


def test_a_dry_gear_has_twice_the_friction_and_nothing_else() -> None:
    """Dry and viscous friction double; every other constant stays."""
    unit, dry = draw_unit("finger", 3), worn(draw_unit("finger", 3), "friction")
    assert dry.servo.dry_friction == 2.0 * unit.servo.dry_friction
    assert dry.servo.viscous_friction == 2.0 * unit.servo.viscous_friction
    back = replace(
        dry.servo,
        dry_friction=unit.servo.dry_friction,
        viscous_friction=unit.servo.viscous_friction,
    )
    assert replace(dry, servo=back) == unit


def test_a_slipped_spool_leaves_the_tendon_loose_by_what_it_slipped() -> None:
    """Wound in by the slip and the unit's own slack the line only just begins to pull."""
    slips = []
    for seed in range(10):
        unit, slipped = draw_unit("finger", seed), worn(draw_unit("finger", seed), "spool")
        loose = slipped.tendon.slack
        slips.append((loose - unit.tendon.slack) / unit.servo.spool_radius)
        assert replace(slipped, tendon=unit.tendon) == unit
        for wound, taut in ((loose - 1e-6, False), (loose + 1e-4, True)):
            line = BenchTendon(slipped.tendon)
            line.settle(wound, 0.0)
            assert (line.spool_side > 0.0) == taut
    assert min(slips) >= SLIP[0]
    assert max(slips) <= SLIP[1]
    assert len(set(slips)) == 10


@pytest.mark.parametrize("name", PLANTINGS)
def test_each_planting_spoils_what_its_effect_names(name: str, tmp_path: Path) -> None:
    """The unit's file of truth lists the effect with another number; a tilt spares the rails."""
    size = PLANTINGS[name].sizes[1]
    for bench in ("finger", "spring_weak"):
        unit = draw_unit(bench, 3)
        spoilt = PLANTINGS[name].plant(unit, size)
        if name == "gravity_misalignment" and bench != "finger":
            assert spoilt == unit
        elif name == "load_cell_gain":
            assert dict(sensor_effects(spoilt))[name]["scale"] == pytest.approx(size)
            assert name not in dict(sensor_effects(unit))
            assert replace(spoilt, load_cell=unit.load_cell) == unit
        else:
            by_torque = {"stribeck_friction", "viscous_friction"}  # at the string, by the radius
            along = by_torque if name == "spool_radius_error" else set()
            assert changed_effects(unit, spoilt, tmp_path) == {name, *along}


def changed_effects(unit: BenchUnit, spoilt: BenchUnit, folder: Path) -> set[str]:
    """Return the effects whose numbers differ between the truths of two units."""
    tables = []
    for each in (unit, spoilt):
        write_plant_file(folder / "plant.toml", each)
        rows = tomllib.loads((folder / "plant.toml").read_text(encoding="utf-8"))["effects"]
        tables.append({row["name"]: row.get("parameters") for row in rows})
    return {effect for effect, numbers in tables[0].items() if numbers != tables[1][effect]}


def test_a_seed_plants_the_same_three_on_every_bench() -> None:
    """Three different ones, and not the same three in every unit."""
    kinds = {frozenset(planted_causes(seed)) for seed in range(40, 50)}
    assert {len(names) for names in kinds} == {3}
    assert len(kinds) > 5
    finger, rail = (worn(draw_unit(b, 40), "planted") for b in ("finger", "spring_weak"))
    assert finger == plant_causes(draw_unit("finger", 40)) != draw_unit("finger", 40)
    assert (finger.servo, finger.load_cell) == (rail.servo, rail.load_cell)


def test_the_word_of_a_bench_says_what_is_worn(tmp_path: Path) -> None:
    """A fourth part of the word; the unit's file of truth has it."""
    assert parse_word("virtual:finger:7:spool") == ("finger", 7)
    assert parse_wear("virtual:finger:7:spool") == "spool"
    assert parse_wear("virtual:finger:7") == NEW
    address = BenchAddress(bench="finger", port="virtual:finger:7:friction")
    assert (address.unit, address.wear) == (7, "friction")
    with pytest.raises(InvalidVirtualBench, match="new, friction, spool, planted"):
        parse_word("virtual:finger:7:rust")
    with pytest.raises(UnknownName, match="No wear of a virtual bench named 'rust'"):
        worn(draw_unit("finger", 7), "rust")
    lockstep_of("virtual:finger:7:spool").plant_file(tmp_path / "plant.toml")
    slack = worn(draw_unit("finger", 7), "spool").tendon.slack
    assert f"slack = {slack}" in (tmp_path / "plant.toml").read_text(encoding="utf-8")
