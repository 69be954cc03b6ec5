"""What a model that is right leaves: noise, and by how much simple laws miss."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tendon_newton.data.parameters import BenchScale
from tendon_newton.diagnosis.search.worlds import Floors, Worlds
from tendon_newton.effects import find_effect
from tendon_newton.identification.objective import Scales

FORM_THETA, FORM_FORCE = 3.0e-3, 0.1
"""Angle [rad] and force [N] by which a law of dry friction misses real friction on a nominal bench:
bristles of 5 to 40 um give way before anything slides, and it sticks elsewhere."""
LEAST_THETA, LEAST_FORCE = 1.0e-3, 0.03
"""The same without dry friction: steps of the simulation, and a row's worth of timing at jumps."""

BREAKAWAY = 3.0
"""How much more a law misses whose breakaway force is above the sliding one: it jumps [1]."""
REST = 0.1
"""Weight of a row at rest where something sticks [1]: one error in all rows of a rest. Where
nothing sticks all rows at rest together count at most as much as those in motion."""


def floors_of(worlds: Worlds, names: Sequence[str]) -> Floors:
    """Return what noise and errors of form leave with some effects in the model.

    Args:
        worlds: Have the noise and the bench's size.
        names: Effects of the model, those it started with included.
    """
    noise, scale = worlds.study.noise, worlds.study.scale
    dry = is_dry(names)
    theta, force = (FORM_THETA, FORM_FORCE) if dry else (LEAST_THETA, LEAST_FORCE)
    if any(len(find_effect(name).dry) > 1 for name in names):
        theta, force = BREAKAWAY * theta, BREAKAWAY * force
    return Floors(
        theta=float(np.hypot(noise.theta, theta * scale.turn)),
        force=float(np.hypot(noise.force or 0.0, force * scale.force)),
        rest=REST if dry else worlds.rest_share,
    )


def form_scales(scale: BenchScale) -> Scales:
    """Return by how much laws of dry friction miss on benches of some size.

    Bristles are as long on a long rail as on a short one, so the angle follows the spool alone.
    """
    return Scales(theta=FORM_THETA * scale.turn, force=FORM_FORCE * scale.force)


def is_dry(names: Sequence[str]) -> bool:
    """Tell whether some effects make a tendon or a joint stick."""
    return any(find_effect(name).dry or name == "joint_dry_friction" for name in names)
