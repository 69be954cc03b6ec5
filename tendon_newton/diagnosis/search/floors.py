"""What a model that is right leaves: noise, and by how much simple laws miss."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tendon_newton.data.parameters import BenchScale
from tendon_newton.diagnosis.search.decide.rule import FORM_FORCE, FORM_THETA, LADDER, REST
from tendon_newton.diagnosis.search.worlds import Floors, Worlds
from tendon_newton.effects import find_effect
from tendon_newton.identification.objective import Scales


def floors_of(worlds: Worlds, names: Sequence[str], *, jumping: bool = True) -> Floors:
    """Return what noise and errors of form leave with some effects in the model.

    Args:
        worlds: Have the noise and the bench's size.
        names: Effects of the model, those it started with included.
        jumping: Whether what jumps misses more than what only sticks.
    """
    noise, form, dry = worlds.study.noise, form_scales(worlds.study.scale), is_dry(names)
    jumps = jumping and any(map(breaks_away, names))
    rung = LADDER if jumps else 1.0 if dry else 1.0 / LADDER
    least = min(1.0, rung)
    return Floors(
        theta=float(np.hypot(noise.theta, rung * form.theta)),
        force=float(np.hypot(noise.force or 0.0, rung * form.force)),
        form=Scales(theta=least * form.theta, force=least * form.force),
        rest=REST if dry else worlds.rest_share,
    )


def form_scales(scale: BenchScale) -> Scales:
    """Return by how much laws of dry friction miss on benches of some size.

    Bristles are as long on a long rail as on a short one, so the angle follows the spool alone.
    """
    return Scales(theta=FORM_THETA * scale.turn, force=FORM_FORCE * scale.force)


def is_dry(names: Sequence[str]) -> bool:
    """Tell whether some effects make a tendon or a joint stick, or stand for what does."""
    laws = {law for name in names for law in (name, *find_effect(name).includes)}
    return any(find_effect(law).dry or law == "joint_dry_friction" for law in laws)


def breaks_away(name: str) -> bool:
    """Tell whether an effect's friction at rest is another than in motion: it jumps."""
    return any(number.startswith("static") for number in find_effect(name).dry)
