"""What can be planted, and the servo and bench under it."""

from collections.abc import Mapping

import numpy as np

from tests.planted.physics.causes import Causes
from tests.planted.sets.draws_actuator import ACTUATOR
from tests.planted.sets.draws_mechanism import MECHANISM, TRANSMISSION
from tests.planted.sets.draws_outside import NEAR, OUTSIDE
from tests.planted.sets.draws_sensor import FURTHER_SENSORS, SENSOR
from tests.planted.sets.planted import Draw

__all__ = [
    "ALONE", "COULOMB_KNOWN", "EFFECTS", "FURTHER_SENSORS", "MIX_OF", "NEAR", "OUTSIDE", "SIDES",
    "VISCOUS_KNOWN", "WITH_FRICTION", "base_causes",
]  # fmt: skip

VISCOUS_KNOWN = 1.5  # [N s/rad] of a servo whose friction the model knows
COULOMB_KNOWN = 0.8  # [N]
BRISTLES = (5e-6, 40e-6)  # [m] range of pre-sliding travels, drawn evenly in the logarithm
MIX_OF: Mapping[str, str] = {"backlash": "P"}
"""Benches that a cause needs: a string under tension closes every play."""

SIDES: Mapping[str, Mapping[str, Draw]] = {
    "actuator": ACTUATOR,
    "transmission": TRANSMISSION,
    "mechanism": MECHANISM,
    "sensor": SENSOR,
}
EFFECTS: Mapping[str, Draw] = {name: draw for side in SIDES.values() for name, draw in side.items()}
WITH_FRICTION = frozenset({"presliding"})  # Without dry friction these do nothing
ALONE = tuple(name for name in EFFECTS if name not in WITH_FRICTION)
"""What an exam plants."""


def base_causes(
    rng: np.random.Generator,
    *,
    known_friction: bool,
    imperfection: float,
    second_form: bool = False,
) -> Causes:
    """Draw the servo and the bench under the planted cause.

    Args:
        known_friction: Whether the servo has the friction that its model lists.
        imperfection: Size of unlisted faults [1]: 1 is about 0.3 % of the masses, 1 % of the
            damping, 3 % of curvature in the viscous friction and a ripple of 5 mN.
        second_form: Whether bristles, knees and contacts have the plant's other laws.
    """
    faults = imperfection * rng.uniform(-1.0, 1.0, size=3)
    return Causes(
        second_form=second_form,
        viscous=VISCOUS_KNOWN if known_friction else 0.0,
        coulomb=COULOMB_KNOWN if known_friction else 0.0,
        bristle=_bristle(rng),
        guide_bristle=_bristle(rng.spawn(1)[0]),
        mass_scale=1.0 + 0.003 * float(faults[0]),
        damper_scale=1.0 + 0.01 * float(faults[1]),
        viscous_curvature=0.03 * float(faults[2]),
        cogging=0.005 * imperfection,
    )


def _bristle(rng: np.random.Generator) -> float:
    return float(np.exp(rng.uniform(*np.log(BRISTLES))))


# causes that one spring alone cannot tell from others: they need the finger, or two springs
NEEDS_FINGER = frozenset(
    {
        "spool_radius_error",
        "joint_stiffness_error",
        "obstruction",
        "tendon_compliance",
        "gravity_misalignment",
        "tendon_slack",
    }
)
