"""From recordings to findings: beginnings choose, all rows decide, every cause gets an account."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Recording
from tendon_newton.diagnosis.findings import Findings, Found
from tendon_newton.diagnosis.posterior import Posterior
from tendon_newton.diagnosis.result import Criterion, Verdict
from tendon_newton.diagnosis.search.decide.account import (
    TOGETHER,
    candidates,
    criteria_of,
    explained_share,
)
from tendon_newton.diagnosis.search.decide.decision import (
    Decided,
    decide,
    leaves_nothing_at_any_step,
    new_name,
    special_case_left_open,
    transfer,
)
from tendon_newton.diagnosis.search.decide.extent import Limits, beginnings, deciding, limits_of
from tendon_newton.diagnosis.search.decide.fitted_sets import (
    found_of,
    posterior_of,
    probability,
    weights_of,
)
from tendon_newton.diagnosis.search.decide.told import as_told
from tendon_newton.diagnosis.search.decide.unnamed import with_unnamed
from tendon_newton.diagnosis.search.floors import floors_of
from tendon_newton.diagnosis.search.pool import FOLLOWED, Pool
from tendon_newton.diagnosis.search.prune import prune, settle
from tendon_newton.diagnosis.search.refit import Fit, refit, start_fits, values_of
from tendon_newton.diagnosis.search.rule import LEAST_EXPLAINED, PRICE
from tendon_newton.diagnosis.search.search_worlds import SearchWorlds
from tendon_newton.diagnosis.search.strategy import find, go_on_all_rows
from tendon_newton.identification.study import Study

PRICE_SHARE = 0.3
"""Share of the price `PRICE` that the search asks of a cause [1]; the decision asks all of it."""
STOPPED = "The search was stopped before its end: causes may be missing."
OVER_BUDGET = "The search ended at its budget of time: causes may be missing."
UNDECIDED = (
    "Found, and not named, since the time was over before they were tested on parts that no number "
    "had seen"
)
HELD = 1.0e12  # Curvature that holds a number where it is stated
MOST_CAUSES = 9  # Causes that are looked for at once


def find_causes(
    recordings: Sequence[Recording],
    study: Study,
    model: Model,
    names: Sequence[str],
    *,
    price: float = PRICE,
    progress: Callable[[str], None] = lambda _: None,
    budget: float | None = None,
    pace: float | None = None,
) -> Findings:
    """Find the causes of a gap.

    Args:
        recordings: Training recordings as they are.
        study: All rows of these recordings.
        model: The model to start from.
        names: Effects that may be named.
        price: Gain in score that each number of a cause must bring [nat per row].
        progress: Told, in a few words, what is being done.
        budget: Time that looking for sets and deciding on them may take [s].
        pace: Time that a candidate takes for a second of recordings [1], where it is known.
    """
    limits = limits_of(budget, pace, recordings, whole=study.kinematic)
    chosen = first = beginnings(recordings, limits.beginnings, whole=study.kinematic)
    pool = whole = pool_of(part_of(study, first, model), FOLLOWED, price, limits)
    if limits.decides_apart:
        chosen = deciding(recordings, whole=study.kinematic)
        is_all = all(own is other for own, other in zip(chosen, recordings, strict=False))
        decisive = study if is_all else part_of(study, chosen, model)
        whole = pool_of(decisive, FOLLOWED[1:], price, limits)
    try:
        fit = find(pool, (*study.fit_columns(model), *pool.worlds.built_columns), names, progress)
        pool.price_share, searched = 1.0, pool
        progress(f"testing {', '.join(fit.names) or 'whether anything is missing'}")
        fit = fit if pool.is_late else prune(pool, fit)
        if go_on_all_rows(pool, fit, whole, names, progress):
            searched, fit = whole, whole.best()
            whole.price_share, pool.added = 1.0, whole.added
        fit = fit if pool.is_late else settle(searched, fit, names)
        early = (OVER_BUDGET,) if pool.is_late else ()
    except KeyboardInterrupt:
        if frozenset() not in pool.fits:
            raise
        early = (STOPPED,)
        searched, fit = pool, pool.best()
        progress("ending the search; Ctrl-C again ends without an answer")
    progress(f"deciding on {len(chosen)} of {len(recordings)} recordings")
    whole.price_share, whole.until = 1.0, limits.decided
    if searched is not whole:
        transfer(pool, [pool.fits[frozenset()]], whole)
    decided = as_told(whole, decide(searched, fit, whole, names), names)
    if decided.undecided:
        early = (*early, f"{UNDECIDED}: {', '.join(decided.undecided)}.")
    baseline = fit_baseline(whole, study.fit_columns(model))
    return conclude_search(pool, whole, names, baseline, decided, early)


def pool_of(study: Study, followed: Sequence[int], price: float, limits: Limits) -> Pool:
    """Return where sets that are fitted on a study are gathered."""
    worlds = SearchWorlds(study)
    return Pool(
        worlds=worlds, floors=floors_of(worlds, ()), dearest=price, price_share=PRICE_SHARE,
        most=MOST_CAUSES, until=limits.searched, followed=followed,
    )  # fmt: skip


def fit_baseline(pool: Pool, fit_columns: Sequence[int]) -> Fit:
    """Return the starting model, its unknown numbers refitted and all others as they are stated."""
    worlds, start = pool.worlds, pool.fits[frozenset()]
    values = values_of(worlds, start.columns, start.place)
    stated = {c: v if c in fit_columns else worlds.study.base_value(c) for c, v in values.items()}
    (fit,) = start_fits(worlds, [((), stated)], pool.floors, near=True)
    held = np.diag([0.0 if c in fit_columns else HELD for c in fit.columns])
    (fit,) = refit(worlds, [fit], pool.floors, iterations=4, coarse=0, holds=[held])
    return fit


def part_of(study: Study, recordings: Sequence[Recording], model: Model) -> Study:
    """Return a study of some of its recordings, with its scale and its noise."""
    part = Study(
        recordings,
        model,
        study.table.effects,
        time_step=study.time_step,
        in_segments=True,
        scale=study.scale,
        like=study,
    )
    part.noise = study.noise
    return part


def conclude_search(
    pool: Pool, decisive: Pool, names: Sequence[str], baseline: Fit, decided: Decided,
    early: tuple[str, ...],
) -> Findings:  # fmt: skip
    """Put what was decided into words and numbers."""
    final = ordered(decided)
    share = explained_share(decisive, baseline, final)
    verdict = verdict_of(decisive, final, share)
    named = final if verdict in ("explained", "partly_explained") else None
    shown = found_of(decisive, final, refused=decided.refused)
    criteria = {n: criteria_of(decisive, final, decided, shown, n) for n in final.names}
    rivals = {name: {new_name(final, rival): rival for rival in
                     (*special_case_left_open(decisive, final, shown, name), *own)}
              for name, own in decided.rivals.items()}  # fmt: skip
    weights = weights_of(decisive, shown.point, final, decided.refused)
    classes = {
        name: tuple((rival, found_of(decisive, with_it)) for rival, with_it in own.items())
        for name, own in rivals.items()
    }
    alike = {frozenset(found.effects): found for own in classes.values() for _, found in own}
    worths = {n: decided.losses[n] / decisive.bar(n) for n in final.names}
    told = with_unnamed(decisive, final, shown, names, rivals, worths) if final.names else shown
    stop = None
    if named is None and final.names:
        stop = Criterion(name=TOGETHER, value=1.0 - share, bar=1.0 - LEAST_EXPLAINED, passed=False)
    return Findings(
        verdict=verdict,
        nameless=verdict_of(decisive, decisive.fits[frozenset()], 0.0),
        baseline=found_of(decisive, baseline),
        final=None if named is None else told,
        closest=told,
        suspected=tuple(n for n, own in criteria.items() if not all(c.passed for c in own)),
        classes=classes,
        candidates=candidates(pool, decisive, names, final, decided, criteria, stop),
        criteria=criteria,
        probabilities={n: probability(weights, n, rivals.get(n, ())) for n in final.names},
        posterior=Posterior()
        if named is None
        else posterior_of(decisive, shown, final, weights, alike),
        plain=decided.plain,
        predictor=None if verdict == "no_gap" else predictor_of(decisive, decided, named),
        predicts=decided.predicts,
        finished=not early,
        notes=early,
    )


def predictor_of(decisive: Pool, decided: Decided, named: Fit | None) -> Found | None:
    """Return the set that predicts best, with its numbers; None where it has no further cause."""
    predictor, least = decided.predictor, () if named is None else named.names
    if predictor is None or not set(least) < set(predictor.names):
        return None
    return found_of(decisive, predictor, refused=decided.refused)


def ordered(decided: Decided) -> Fit:
    """Return the fit with its causes in order, those that explain most first."""
    fit = decided.fit
    return replace(fit, names=tuple(sorted(fit.names, key=lambda n: -decided.losses[n])))


def verdict_of(decisive: Pool, final: Fit, share: float) -> Verdict:
    """Judge what is left without and with the causes."""
    if not final.names:
        return "no_gap" if leaves_nothing_at_any_step(decisive, final) else "unexplained"
    if leaves_nothing_at_any_step(decisive, final):
        return "explained"
    return "partly_explained" if share >= LEAST_EXPLAINED else "unexplained"
