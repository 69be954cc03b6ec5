"""A given set of effects fitted to recordings: nothing is looked for and nothing is named."""

from collections.abc import Sequence

from tendon_newton.data.model_file import Model
from tendon_newton.diagnosis.search.coordinates import atoms
from tendon_newton.diagnosis.search.floors import floors_of
from tendon_newton.diagnosis.search.refit import Fit, refit, start_fits, values_of
from tendon_newton.diagnosis.search.search_worlds import Floors, SearchWorlds

STARTS = 3  # Starts that are followed
FIRST_STEPS, LAST_STEPS = 4, 12  # Steps of a refit while effects are added, and at the end


def as_stated(worlds: SearchWorlds, model: Model, effects: Sequence[str]) -> Fit:
    """Return a model as it is, its unknown numbers and those of some effects free to move."""
    study, names = worlds.study, tuple(effects)
    columns = [*study.fit_columns(model), *(c for n in names for c in study.table.columns(n))]
    start = (names, {c: study.base_value(c) for c in columns})
    return start_fits(worlds, [start], floors_of(worlds, names))[0]


def fit_set(worlds: SearchWorlds, model: Model, effects: Sequence[str]) -> Fit:
    """Fit a model's unknown numbers and those of some of its effects, from where it has them."""
    floors, start = floors_of(worlds, effects), as_stated(worlds, model, effects)
    return refit(worlds, [start], floors, iterations=2 * LAST_STEPS, coarse=2)[0]


def fit_set_anew(worlds: SearchWorlds, model: Model, effects: Sequence[str]) -> Fit:
    """Fit a model's unknown numbers and effects that it has not, added one after the other."""
    floors = floors_of(worlds, effects)
    own = {c: worlds.study.base_value(c) for c in worlds.study.fit_columns(model)}
    found = start_fits(worlds, [((), own)], floors)
    (fit,) = refit(worlds, found, floors, iterations=FIRST_STEPS)
    return with_effects(worlds, fit, effects, floors)


def with_effects(worlds: SearchWorlds, fit: Fit, effects: Sequence[str], floors: Floors) -> Fit:
    """Add effects to a fit, one after the other, and fit all numbers.

    Each starts from the best of its typical values, whatever stands moves with it. Where none
    leads further than the fit without it, it starts from the value that means nothing.

    Args:
        worlds: Simulates candidates.
        fit: Where to begin.
        effects: What it has not.
        floors: Least scale of each signal.
    """
    study = worlds.study
    for name in effects:
        before, less = values_of(worlds, fit.columns, fit.place), fit
        starts = [((*fit.names, name), {**before, **atom}) for atom in atoms(study, name)]
        near = sorted(start_fits(worlds, starts, floors), key=lambda f: f.score)[:STARTS]
        fit = min(refit(worlds, near, floors, iterations=FIRST_STEPS), key=lambda f: f.score)
        if fit.score > less.score:
            strength = study.table.columns(name)[0]
            none = {**starts[0][1], strength: study.parameter(strength).null}
            (fit,) = start_fits(worlds, [(fit.names, none)], floors)
    return refit(worlds, [fit], floors, iterations=LAST_STEPS, coarse=0)[0]
