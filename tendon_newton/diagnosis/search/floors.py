"""What a model that is right leaves: noise, and by how much simple laws miss."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tendon_newton.data.parameters import BenchScale
from tendon_newton.diagnosis.search.rule import (
    FORM_FORCE,
    FORM_THETA,
    LADDER,
    REST,
    SEARCHED,
)
from tendon_newton.diagnosis.search.search_worlds import Floors, SearchWorlds
from tendon_newton.effects import law_of, special_cases
from tendon_newton.identification.signals import Scales
from tendon_newton.identification.study import Study


def floors_of(worlds: SearchWorlds, names: Sequence[str], *, usual: bool = False) -> Floors:
    """Return what noise and errors of form leave with some causes in the model.

    Args:
        worlds: Have the noise, the bench's size and the effects of the starting model.
        names: Causes besides.
        usual: Whether laws may miss as much as they usually do, and those that jump more than those
            that only stick: that is for a verdict. What hides there must not hide from a search.
    """
    laws = (*worlds.study.known, *names)
    form = form_of(worlds, names, 1.0 if usual else SEARCHED)
    rung = LADDER if usual and any(map(breaks_away, laws)) else 1.0
    return least_scales(worlds.study, form, rung, REST if is_dry(laws) else worlds.rest_share)


def least_scales(study: Study, form: Scales, share: float, rest: float) -> Floors:
    """Return what noise and a share of some errors of form leave of each signal."""
    signals = ("theta", "force", *study.noise.others)
    sizes = {s: float(np.hypot(study.noise.of(s), share * form.of(s))) for s in signals}
    theta, force = sizes.pop("theta"), sizes.pop("force")
    return Floors(theta=theta, force=force, others=sizes, rest=rest)


def form_of(worlds: SearchWorlds, names: Sequence[str], share: float = SEARCHED) -> Scales:
    """Return by how much a model's laws miss where nothing jumps, some causes in the model."""
    form = usual_form(worlds.study)
    laws = (*worlds.study.known, *names)
    share *= 1.0 if is_dry(laws) or any(law_of(n).undamped for n in laws) else 1.0 / LADDER
    return worlds.study.form(Scales(theta=share * form.theta, force=share * form.force))


def usual_form(study: Study) -> Scales:
    """Return by how much laws of dry friction usually miss; on a path, what noise would hide.

    Where a shaft is led, nothing that a law misses in a row is carried on to the next: what it
    misses is what is left.
    """
    form = form_scales(study.scale)
    if study.is_led:
        form = replace(form, force=min(form.force, SEARCHED * study.noise.of("force")))
    return study.form(form)


def form_scales(scale: BenchScale) -> Scales:
    """Return by how much laws of dry friction miss on benches of some size.

    Bristles are as long on a long rail as on a short one, so the angle follows the spool alone.
    """
    return Scales(theta=FORM_THETA * scale.turn, force=FORM_FORCE * scale.force)


def is_dry(names: Sequence[str]) -> bool:
    """Tell whether some effects make a tendon or a joint stick, or stand for what does."""
    laws = {law for name in names for law in (name, *special_cases(name))}
    return any(law_of(law).dry or law_of(law).name == "joint_dry_friction" for law in laws)


def breaks_away(name: str) -> bool:
    """Tell whether an effect's friction at rest is another than in motion: it jumps."""
    return any(number.startswith("static") for number in law_of(name).dry)
