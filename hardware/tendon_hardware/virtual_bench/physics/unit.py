"""One unit of a bench: constants drawn by a seed."""

import random
from dataclasses import dataclass, field, fields, replace
from typing import Any, TypeVar, cast

from tendon_hardware.virtual_bench.memory.control_table import XC330_T288_T, XL330_M288_T
from tendon_hardware.virtual_bench.memory.feetech_table import STS3215, STS3250
from tendon_hardware.virtual_bench.physics.constants import (
    AntagonistConstants,
    FingerConstants,
    HandBallConstants,
    HandConstants,
    LoadCellConstants,
    ServoConstants,
    SliderConstants,
    TendonConstants,
)
from tendon_newton.errors import look_up

Constants = TypeVar(
    "Constants",
    bound=ServoConstants
    | TendonConstants
    | FingerConstants
    | AntagonistConstants
    | HandConstants
    | SliderConstants
    | LoadCellConstants,
)
MechanismConstants = FingerConstants | AntagonistConstants | HandConstants | SliderConstants

BENCHES: dict[str, MechanismConstants] = {
    "spring_weak": SliderConstants(stiffness=200.0),
    "spring_strong": SliderConstants(stiffness=800.0),
    "finger": FingerConstants(),
    "finger_antagonist": AntagonistConstants(),
    "hand": HandConstants(),
    "hand_ball": HandBallConstants(),
    "hand_pen": HandBallConstants(),
}
"""Bench names and the middle of each mechanism's draw."""
SERVOS: dict[str, ServoConstants] = {
    XC330_T288_T.name: ServoConstants(),
    XL330_M288_T.name: ServoConstants(
        torque_constant=0.35,  # BAM: 0.286 to 0.373
        resistance=2.5,  # BAM: 2.00 to 2.81
        inertia=0.0018,
        dry_friction=0.009,  # BAM: 0.0048 to 0.0109
        viscous_friction=0.0044,  # XL330 logs
        motor_load_friction=0.28,
        tendon_load_friction=0.15,
        supply_voltage=5.0,
        supply_resistance=0.2,
    ),
    STS3215.name: ServoConstants(
        torque_constant=1.25,  # BAM, an STS3215 of 12 V: 1.28
        resistance=4.3,  # data sheet: 12 V / 2.7 A at stall; BAM: 2.75
        inertia=0.0216,  # BAM
        dry_friction=0.053,  # BAM
        viscous_friction=0.028,  # BAM
        motor_load_friction=0.05,  # BAM: 0.045
        tendon_load_friction=0.24,  # BAM: 0.244
        supply_voltage=12.0,
        supply_resistance=0.15,
    ),
    STS3250.name: ServoConstants(
        torque_constant=1.25,  # the gear is the STS3215's
        resistance=2.6,  # the STS3215's, times the ratio of stall torques
        inertia=0.02,
        dry_friction=0.06,
        viscous_friction=0.03,
        motor_load_friction=0.05,
        tendon_load_friction=0.24,
        supply_voltage=12.0,
        supply_resistance=0.15,
    ),
}
"""Servo names and the middle of each draw."""


@dataclass(frozen=True, kw_only=True, slots=True)
class LineConstants:
    """Every constant of one servo, its tendon and its load cell."""

    servo: ServoConstants
    tendon: TendonConstants
    load_cell: LoadCellConstants


@dataclass(frozen=True, kw_only=True, slots=True)
class BenchUnit:
    """Every constant of one servo, tendon, mechanism and load cell."""

    bench: str
    seed: int
    servo: ServoConstants
    tendon: TendonConstants
    mechanism: MechanismConstants
    load_cell: LoadCellConstants
    further: tuple[LineConstants, ...] = field(default=(), repr=False)
    """Further servos on the bus. Not in the text by which units of one servo are compared."""

    @property
    def lines(self) -> tuple[LineConstants, ...]:
        """Constants of all servos, in the order of the asset's tendons."""
        first = LineConstants(servo=self.servo, tendon=self.tendon, load_cell=self.load_cell)
        return (first, *self.further)


def draw_unit(bench: str, seed: int, servo: str = XC330_T288_T.name) -> BenchUnit:
    """Draw a unit; the servo and the load cell of a seed are the same on every bench.

    Raises:
        UnknownName: No such bench or servo; the message lists the known ones.
    """
    count = servo_count(bench)
    nominal = look_up("virtual servo", servo, SERVOS)
    own = random.Random(f"{bench} {seed}")
    shared = random.Random(f"servo {seed}")
    middle = BENCHES[bench]
    tendon = drawn_about(TendonConstants(), own)
    if isinstance(middle, SliderConstants):  # no wrap on the way to a carriage
        tendon = replace(tendon, routing_friction=0.0)
    return BenchUnit(
        bench=bench,
        seed=seed,
        servo=drawn_about(nominal, shared),
        tendon=tendon,
        mechanism=drawn_about(middle, own),
        load_cell=drawn_about(LoadCellConstants(), shared),
        further=tuple(
            drawn_line(servo, random.Random(f"servo {seed} {place}")) for place in range(1, count)
        ),
    )


def servo_count(bench: str) -> int:
    """Return how many servos a virtual bench has on its bus.

    Raises:
        UnknownName: No such bench; the message lists the known ones.
    """
    middle = look_up("virtual bench", bench, BENCHES)
    if isinstance(middle, HandConstants):
        return len(middle.stiffness)
    return 2 if isinstance(middle, AntagonistConstants) else 1


def has_ball(bench: str) -> bool:
    """Tell whether a virtual bench has a ball, and a camera that sees it."""
    return isinstance(BENCHES[bench], HandBallConstants)


def drawn_line(servo: str, rng: random.Random) -> LineConstants:
    """Draw a further servo with its tendon and load cell."""
    return LineConstants(
        servo=drawn_about(SERVOS[servo], rng),
        tendon=drawn_about(TendonConstants(), rng),
        load_cell=drawn_about(LoadCellConstants(), rng),
    )


def drawn_about(middle: Constants, rng: random.Random) -> Constants:
    """Draw each constant uniformly about its middle, in the order of the fields."""
    values: dict[str, Any] = {}
    for each in fields(middle):
        value: Any = getattr(middle, each.name)
        width: Any = each.metadata["width"]
        if isinstance(value, tuple):
            pairs = zip(cast(tuple[float, ...], value), width, strict=True)
            values[each.name] = tuple(v + w * rng.uniform(-1.0, 1.0) for v, w in pairs)
        else:  # the width belongs to the class's own nominal value: keep its proportion
            scale = value / each.default if each.default else 1.0
            values[each.name] = value + width * scale * rng.uniform(-1.0, 1.0)
    return replace(middle, **values)
