"""A given set of effects fitted to recordings: nothing is looked for and nothing is named."""

from collections.abc import Sequence

from tendon_newton.data.model_file import Model
from tendon_newton.diagnosis.search.coordinates import atoms
from tendon_newton.diagnosis.search.floors import floors_of
from tendon_newton.diagnosis.search.refit import Fit, refit, start_fits, values_of
from tendon_newton.diagnosis.search.search_worlds import SearchWorlds

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
    """Fit a model's unknown numbers and effects that it has not, added one after the other.

    Each starts from the best of its typical values, whatever stands moves with it.
    """
    study = worlds.study
    floors = floors_of(worlds, effects)
    own = {c: study.base_value(c) for c in study.fit_columns(model)}
    found = start_fits(worlds, [((), own)], floors)
    found = refit(worlds, found, floors, iterations=FIRST_STEPS)
    for name in effects:
        best = min(found, key=lambda f: f.score)
        before = values_of(worlds, best.columns, best.place)
        starts = [((*best.names, name), {**before, **atom}) for atom in atoms(study, name)]
        near = sorted(start_fits(worlds, starts, floors), key=lambda f: f.score)[:STARTS]
        found = refit(worlds, near, floors, iterations=FIRST_STEPS)
    best = min(found, key=lambda f: f.score)
    return refit(worlds, [best], floors, iterations=LAST_STEPS, coarse=0)[0]
