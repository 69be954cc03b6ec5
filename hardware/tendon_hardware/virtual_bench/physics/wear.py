"""Wear of a unit: a gear that has run dry, a spool that has slipped, one wrong thing, or three.

Wear is put on top of a drawn unit; the units themselves stay as they are. The unit's seed says how
large it is, and which three wrong things: servo, line and load cell of a seed have the same ones on
every bench. Each is named by the effect that describes it.
"""

import random
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

from tendon_hardware.virtual_bench.physics.constants import SliderConstants
from tendon_hardware.virtual_bench.physics.unit import BenchUnit
from tendon_newton.errors import look_up

COUNT = 3  # Wrong things of a unit


@dataclass(frozen=True, kw_only=True, slots=True)
class Planting:
    """A way to spoil a unit, and how far."""

    sizes: tuple[float, float]
    """Least and greatest size: a factor [1], a length [m] or an angle [rad]."""
    plant: Callable[[BenchUnit, float], BenchUnit]


def thicker_spool(unit: BenchUnit, factor: float) -> BenchUnit:
    """Put a spool of another radius on the shaft."""
    return replace(unit, servo=replace(unit.servo, spool_radius=factor * unit.servo.spool_radius))


def grease(unit: BenchUnit, factor: float) -> BenchUnit:
    """Let the gear run in thick grease."""
    viscous = factor * unit.servo.viscous_friction
    return replace(unit, servo=replace(unit.servo, viscous_friction=viscous))


def loose_line(unit: BenchUnit, length: float) -> BenchUnit:
    """Leave the line loose by a length [m]."""
    return replace(unit, tendon=replace(unit.tendon, slack=unit.tendon.slack + length))


def soft_line(unit: BenchUnit, factor: float) -> BenchUnit:
    """Take a line of another stiffness."""
    line = unit.tendon
    softer = replace(
        line,
        spool_side_stiffness=factor * line.spool_side_stiffness,
        mechanism_side_stiffness=factor * line.mechanism_side_stiffness,
    )
    return replace(unit, tendon=softer)


def stiff_springs(unit: BenchUnit, factor: float) -> BenchUnit:
    """Make the springs of the mechanism stiffer."""
    own = unit.mechanism
    if isinstance(own, SliderConstants):
        return replace(unit, mechanism=replace(own, stiffness=factor * own.stiffness))
    stiffer = tuple(factor * each for each in own.stiffness)
    return replace(unit, mechanism=replace(own, stiffness=stiffer))


def tilt(unit: BenchUnit, angle: float) -> BenchUnit:
    """Tip a finger's bench by an angle [rad]; a rail with its spring does not notice."""
    own = unit.mechanism
    if isinstance(own, SliderConstants):
        return unit
    return replace(unit, mechanism=replace(own, tilt=own.tilt + angle))


def wrong_scale(unit: BenchUnit, factor: float) -> BenchUnit:
    """Let the load cell give other counts than when it was calibrated."""
    counts = factor * unit.load_cell.counts_per_newton
    return replace(unit, load_cell=replace(unit.load_cell, counts_per_newton=counts))


PLANTINGS: dict[str, Planting] = {
    "spool_radius_error": Planting(sizes=(1.06, 1.15), plant=thicker_spool),
    "viscous_friction": Planting(sizes=(3.0, 6.0), plant=grease),
    "tendon_slack": Planting(sizes=(0.002, 0.006), plant=loose_line),
    "tendon_compliance": Planting(sizes=(0.1, 0.25), plant=soft_line),
    "joint_stiffness_error": Planting(sizes=(1.15, 1.4), plant=stiff_springs),
    "gravity_misalignment": Planting(sizes=(0.2, 0.5), plant=tilt),
    "load_cell_gain": Planting(sizes=(1.08, 1.25), plant=wrong_scale),
}
"""Effect -> how a unit is spoilt so that this effect describes it."""


def planted_causes(seed: int) -> dict[str, float]:
    """Return the three wrong things of a seed, each with its size."""
    rng = random.Random(f"planted {seed}")
    names = rng.sample(sorted(PLANTINGS), COUNT)
    return {name: rng.uniform(*PLANTINGS[name].sizes) for name in names}


def plant_causes(unit: BenchUnit) -> BenchUnit:
    """Return a unit with the three wrong things of its seed."""
    for name, size in planted_causes(unit.seed).items():
        unit = PLANTINGS[name].plant(unit, size)
    return unit


def planted_size(name: str, seed: int) -> float:
    """Return the size of one wrong thing of a seed, alone."""
    return random.Random(f"planted {name} {seed}").uniform(*PLANTINGS[name].sizes)


def plant_one(name: str, unit: BenchUnit, _rng: random.Random) -> BenchUnit:
    """Return a unit with one wrong thing, of the same size on every bench of its seed."""
    return PLANTINGS[name].plant(unit, planted_size(name, unit.seed))


NEW = "new"  # Word for a unit without wear
FRICTION_GROWTH = 2.0
"""Dry and viscous friction of a gear that has lost its grease, over those of a new one [1]. What
grows with the load is left alone: twice as much of it, and the finger no longer closes at all."""
SLIP = (0.2, 0.6)
"""Least and greatest angle by which a spool slips on its shaft [rad]: one to two teeth of a
25-tooth spline; 2.5 to 7.5 mm of loose tendon."""


def wear_friction(unit: BenchUnit, rng: random.Random) -> BenchUnit:
    """Let the gear run dry; of several servos, the first one's."""
    servo = unit.servo
    return replace(
        unit,
        servo=replace(
            servo,
            dry_friction=FRICTION_GROWTH * servo.dry_friction,
            viscous_friction=FRICTION_GROWTH * servo.viscous_friction,
        ),
    )


def wear_spool(unit: BenchUnit, rng: random.Random) -> BenchUnit:
    """Let the spool slip on its shaft, so that the servo's zero leaves the tendon loose."""
    slipped = rng.uniform(*SLIP) * unit.servo.spool_radius
    return replace(unit, tendon=replace(unit.tendon, slack=unit.tendon.slack + slipped))


WEARS: dict[str, Callable[[BenchUnit, random.Random], BenchUnit]] = {
    NEW: lambda unit, rng: unit,
    "friction": wear_friction,
    "spool": wear_spool,
    "planted": lambda unit, rng: plant_causes(unit),
    **{name: partial(plant_one, name) for name in PLANTINGS},
}
"""Kinds of wear of a unit."""


def worn(unit: BenchUnit, wear: str) -> BenchUnit:
    """Return a unit after some use.

    Args:
        wear: A name of `WEARS`.

    Raises:
        UnknownName: No such wear; the message lists the known ones.
    """
    wearing = look_up("wear of a virtual bench", wear, WEARS)
    return wearing(unit, random.Random(f"wear {unit.bench} {unit.seed}"))
