"""Wear of a unit: a gear that has run dry, a spool that has slipped, one wrong thing, or three.

Wear is put on top of a drawn unit; the units themselves stay as they are. Its size is drawn by the
unit's seed, where it has one.
"""

import random
from collections.abc import Callable
from dataclasses import replace
from functools import partial

from tendon_hardware.virtual_bench.physics.planted import PLANTINGS, plant_causes, plant_one
from tendon_hardware.virtual_bench.physics.unit import BenchUnit
from tendon_newton.errors import look_up

NEW = "new"
"""Word for a unit without wear."""
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
