"""Which faults of a virtual unit matter: its test runs again with one fault mended at a time.

The plant that was recorded answers itself.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from functools import partial
from typing import Any

import numpy as np

from tendon_hardware.benches.bench import bench_of
from tendon_hardware.benches.bench_address import BenchAddress
from tendon_hardware.collection.collect_settings import CollectSettings
from tendon_hardware.collection.excitation_plan import PlannedRun, find_plan
from tendon_hardware.servos import find_servo
from tendon_hardware.servos.host_position_loop import HostPositionLoop, no_stronger
from tendon_hardware.virtual_bench import LockstepBench
from tendon_hardware.virtual_bench.emulation.truth import sensor_effects
from tendon_hardware.virtual_bench.physics.obstacle import NOMINAL_SPOOL
from tendon_hardware.virtual_bench.physics.unit import BENCHES, BenchUnit, draw_unit
from tendon_hardware.virtual_bench.physics.wear import worn
from tendon_newton.data.recording import Array

STIFF = 1.0e5
"""Stiffness of each half of a line that hardly gives [N/m]: six times a drawn one. Ten times that
is too stiff for the plant's step."""
SERVO = "xc330_t288_t"
SETTINGS = CollectSettings(loop=no_stronger(HostPositionLoop(), find_servo(SERVO)))
Signals = Mapping[str, float]  # Signal, ``theta`` or ``force`` -> mean squared change [rad2, N2]


def mended(unit: BenchUnit, part: str, **constants: Any) -> BenchUnit:
    """Return a unit with other constants of a part, of which a mechanism has only some."""
    own = getattr(unit, part)
    known = {field.name for field in fields(own)}
    there = {name: value for name, value in constants.items() if name in known}
    return replace(unit, **{part: replace(own, **there)})


def as_drawn_up(unit: BenchUnit, *names: str) -> BenchUnit:
    """Return a unit with constants of its mechanism as the nominal bench has them."""
    nominal = BENCHES[unit.bench]
    own = {name: getattr(nominal, name) for name in names if hasattr(nominal, name)}
    return mended(unit, "mechanism", **own)


def calibrated(unit: BenchUnit) -> BenchUnit:
    """Return a unit whose load cell gives what it gave when it was calibrated."""
    cell = draw_unit(unit.bench, unit.seed).load_cell
    return mended(unit, "load_cell", counts_per_newton=cell.counts_per_newton)


def part(name: str, **constants: Any) -> Callable[[BenchUnit], BenchUnit]:
    """Return what mends a part of a unit."""
    return partial(mended, part=name, **constants)


MENDS: dict[tuple[str, ...], Callable[[BenchUnit], BenchUnit]] = {
    ("stribeck_friction",): part("servo", dry_friction=0.0),
    ("viscous_friction",): part("servo", viscous_friction=0.0),
    ("load_dependent_friction", "gear_load_friction", "holding_friction"): part(
        "servo", motor_load_friction=0.0, tendon_load_friction=0.0
    ),
    ("voltage_sag",): part("servo", supply_resistance=0.0),
    ("spool_radius_error",): part("servo", spool_radius=NOMINAL_SPOOL),
    ("position_offset",): part("servo", encoder_eccentricity=0.0),
    ("tendon_slack",): part("tendon", slack=0.0),
    ("tendon_compliance",): part(
        "tendon", spool_side_stiffness=STIFF, mechanism_side_stiffness=STIFF
    ),
    ("routing_friction",): part("tendon", guide_friction=0.0, routing_friction=0.0),
    ("joint_stiffness_error",): lambda unit: as_drawn_up(unit, "stiffness"),
    ("joint_damping_error",): lambda unit: as_drawn_up(unit, "damping"),
    ("inertia_error",): lambda unit: as_drawn_up(unit, "mass", "masses"),
    ("joint_dry_friction",): part("mechanism", rail_friction=0.0),
    ("viscoelastic_spring",): part("mechanism", maxwell_ratio=0.0),
    ("spring_stiffening",): part("mechanism", pad_stiffness=0.0),
    ("gravity_misalignment",): part("mechanism", tilt=0.0),
    ("load_cell_gain",): calibrated,
}
"""Effects that name a fault rightly -> what takes it away. The motor's own constants are fitted
without a name, and that a duty stands for 50 ms is no constant of a unit."""
LATE = "load_cell_delay"
"""The fault that the chip's filter is, which no constant of a unit takes away."""


@dataclass(frozen=True, kw_only=True)
class Readings:
    """Test runs of all benches of a unit, one after the other."""

    theta: Array  # Angle that the servo reports [rad], shape (T,)
    force: Array  # Tension as the cell's calibration has it [N], shape (T,)
    late: Array  # The same as a cell that is late gives it [N], shape (T,)


def faults_of(unit: int, plan: str, wear: str) -> dict[str, Signals]:
    """Return how far each fault of a unit moves the readings of its plan's test runs.

    Returns:
        Names that are right for a fault, joined by a blank -> signal -> mean squared change.
    """
    plain = replay(unit, plan, wear, lambda own: own)
    moved = {
        " ".join(names): change(plain, replay(unit, plan, wear, mend))
        for names, mend in MENDS.items()
    }
    moved[LATE] = change(plain, replace(plain, force=plain.late))
    return moved


def change(before: Readings, after: Readings) -> Signals:
    """Return the mean squared change of each signal."""
    return {
        signal: float(np.mean((getattr(after, signal) - getattr(before, signal)) ** 2))
        for signal in ("theta", "force")
    }


def replay(unit: int, plan: str, wear: str, mend: Callable[[BenchUnit], BenchUnit]) -> Readings:
    """Drive a unit through its plan's test runs once more, with something mended."""
    columns = [
        driven(run, mend(worn(draw_unit(run.bench, unit), wear)))
        for run in find_plan(plan)
        if run.split == "test"
    ]
    theta, force, late = (np.concatenate(each) for each in zip(*columns, strict=True))
    return Readings(theta=theta, force=force, late=late)


def driven(
    run: PlannedRun,
    unit: BenchUnit,
    befall: Callable[[LockstepBench, float], None] = lambda _bench, _since: None,
) -> tuple[Array, Array, Array]:
    """Return angle, force and late force of a run, without the rules that end a real one.

    Args:
        run: Planned run.
        unit: Constants of the bench.
        befall: Called at every row with the bench and the time since the run's first [s].
    """
    twin = LockstepBench(unit)
    twin.set_obstacle(run.obstacle)
    address = BenchAddress(bench=run.bench, port="virtual", lockstep=True)
    servo = bench_of(address, twin.servo_port(), twin.clock, [None], [None]).servo
    servo.open()
    servo.configure()
    servo.enable_torque()
    command = run.command(SETTINGS.seed, SETTINGS.rate)
    rest = round(SETTINGS.settle * SETTINGS.rate)
    start, rows = twin.clock.now(), []
    for tick, angle in enumerate((*np.repeat(command[0], rest), *command)):
        twin.clock.sleep_until(start + tick / SETTINGS.rate)
        befall(twin, (tick - rest) / SETTINGS.rate)
        position = servo.read_state().position
        if tick % SETTINGS.divider == 0:
            servo.command_duty(SETTINGS.loop.duty(float(angle), position))
        rows.append((position, twin.state().tension))
    theta, tension = np.array(rows[rest:]).T
    sensors = dict(sensor_effects(unit))
    force = sensors.get("load_cell_gain", {"scale": 1.0})["scale"] * tension
    time = np.arange(force.size) / SETTINGS.rate
    return theta, force, np.interp(time - sensors[LATE]["delay"], time, force)
