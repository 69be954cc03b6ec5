"""A given set of effects fitted to recordings: nothing is looked for and nothing is named."""

from __future__ import annotations

from collections.abc import Sequence

from tendon_newton.data.model_file import Model
from tendon_newton.diagnosis.search.coordinates import atoms
from tendon_newton.diagnosis.search.floors import floors_of
from tendon_newton.diagnosis.search.refit import Fit, refit, start_fits, values_of
from tendon_newton.diagnosis.search.worlds import Floors, Worlds

ROUGH_STEP = 2.0e-3
"""Simulation step [s] while starts are compared."""
STARTS = 3
"""Starts that are followed."""
FIRST_STEPS, LAST_STEPS = 4, 12
"""Steps of a refit while effects are added, and at the end."""


def as_stated(worlds: Worlds, model: Model, effects: Sequence[str]) -> Fit:
    """Return a model as it is, its unknown numbers and those of some effects free to move."""
    study, names = worlds.study, tuple(effects)
    columns = [*study.fit_columns(model), *(c for n in names for c in study.table.columns(n))]
    start = (names, {c: study.base_value(c) for c in columns})
    return start_fits(worlds, [start], floors_of(worlds, names), study.time_step)[0]


def fit_set(worlds: Worlds, model: Model, effects: Sequence[str]) -> Fit:
    """Fit a model's unknown numbers and those of some of its effects, from where it has them."""
    floors, start = floors_of(worlds, effects), as_stated(worlds, model, effects)
    rough = at_step(worlds, start, floors, ROUGH_STEP)
    return finish(worlds, refit(worlds, [rough], floors, iterations=LAST_STEPS, coarse=2), floors)


def fit_set_anew(worlds: Worlds, model: Model, effects: Sequence[str]) -> Fit:
    """Fit a model's unknown numbers and effects that it has not, added one after the other.

    Each starts from the best of its typical values, whatever stands moves with it.
    """
    study = worlds.study
    floors = floors_of(worlds, effects)
    step = max(ROUGH_STEP, study.time_step)
    own = {c: study.base_value(c) for c in study.fit_columns(model)}
    found = start_fits(worlds, [((), own)], floors, step)
    found = refit(worlds, found, floors, iterations=FIRST_STEPS)
    for name in effects:
        best = min(found, key=lambda f: f.score)
        before = values_of(worlds, best.columns, best.place)
        starts = [((*best.names, name), {**before, **atom}) for atom in atoms(study, name)]
        near = sorted(start_fits(worlds, starts, floors, step), key=lambda f: f.score)[:STARTS]
        found = refit(worlds, near, floors, iterations=FIRST_STEPS)
    return finish(worlds, found, floors)


def finish(worlds: Worlds, found: Sequence[Fit], floors: Floors) -> Fit:
    """Follow the best of some fits at the study's own step."""
    best = min(found, key=lambda f: f.score)
    fine = at_step(worlds, best, floors, 0.0)
    return refit(worlds, [fine], floors, iterations=LAST_STEPS, coarse=0)[0]


def at_step(worlds: Worlds, fit: Fit, floors: Floors, step: float) -> Fit:
    """Return a fit at another simulation step [s], no finer than the study's."""
    values = values_of(worlds, fit.columns, fit.place)
    step = max(step, worlds.study.time_step)
    return start_fits(worlds, [(fit.names, values)], floors, step)[0]
