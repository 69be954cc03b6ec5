"""Sets of causes carried on to further recordings: refitted, looked around once, weighed anew."""

from collections.abc import Callable, Mapping, Sequence

from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Recording
from tendon_newton.diagnosis.posterior import FittedSet, Posterior
from tendon_newton.diagnosis.search.decide.find_causes import MOST_CAUSES, part_of
from tendon_newton.diagnosis.search.decide.fitted_sets import found_of, posterior_of, weights_of
from tendon_newton.diagnosis.search.floors import floors_of
from tendon_newton.diagnosis.search.pool import FOLLOWED, Pool
from tendon_newton.diagnosis.search.prune import prune
from tendon_newton.diagnosis.search.refit import refit, start_fits
from tendon_newton.diagnosis.search.rule import PRICE
from tendon_newton.diagnosis.search.search_spans import deciding
from tendon_newton.diagnosis.search.search_worlds import SEARCH_STEP, SearchWorlds
from tendon_newton.diagnosis.search.starts import Start
from tendon_newton.diagnosis.search.strategy import add_sets
from tendon_newton.effects import EFFECTS
from tendon_newton.identification.study import Study
from tendon_newton.identification.testable import testable_effects

STEPS = 4  # Steps of a refit at most: few rows are new


def go_on(
    recordings: Sequence[Recording],
    model: Model,
    known: Posterior,
    *,
    progress: Callable[[str], None] = lambda _: None,
) -> Posterior:
    """Return what further recordings leave open of the sets of an earlier answer.

    Each set starts where it stood. One survey around the best of them looks for others. Nothing is
    tested on parts that no number has seen: that is left to a diagnosis of all recordings.

    Args:
        recordings: All training recordings, the further ones among them.
        model: The model to start from.
        known: Sets of an answer to the earlier ones, at least one.
        progress: Told what is being done.
    """
    study = Study(
        recordings, model, tuple(EFFECTS), time_step=SEARCH_STEP, in_segments=True, tolerant=True
    )
    chosen, names = deciding(recordings, whole=study.kinematic), testable_effects(study)
    is_all = all(own is other for own, other in zip(chosen, recordings, strict=False))
    worlds = SearchWorlds(study if is_all else part_of(study, chosen, model))
    floors = floors_of(worlds, known.sets[0].causes)
    pool = Pool(
        worlds=worlds, floors=floors, dearest=PRICE, most=MOST_CAUSES, followed=FOLLOWED[1:],
    )  # fmt: skip
    progress(f"carrying on {len(known.sets)} sets of causes")
    free = (*study.fit_columns(model), *worlds.built_columns)
    base = {c: study.base_value(c) for c in free}
    starts = [((), base), *(start_of(worlds, own, base) for own in known.sets)]
    begun = start_fits(worlds, starts, floors, near=True)
    pool.add(refit(worlds, begun, floors, iterations=STEPS, coarse=0))
    progress("looking for what else they leave")
    add_sets(pool, pool.best(), names, first=False)
    fit = prune(pool, pool.best())
    found = found_of(pool, fit)
    return posterior_of(pool, found, fit, weights_of(pool, found, fit, ()))


def start_of(worlds: SearchWorlds, own: FittedSet, base: Mapping[int, float]) -> Start:
    """Return the causes of a set and where its numbers stood, column -> value."""
    places = {(owner, p.name): c for c, (owner, p) in enumerate(worlds.study.table.owners)}
    stood = {
        places[key]: number.coordinate.value(number.place)
        for number in own.numbers
        if (key := (number.owner, number.name)) in places
    }
    return own.causes, worlds.in_seconds({**base, **stood}, -1)
