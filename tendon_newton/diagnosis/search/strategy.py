"""From a survey to a set of causes: choose, refit jointly, look again from there."""

from collections.abc import Callable, Sequence

import numpy as np

from tendon_newton.diagnosis.search.choice import Chooser, choose, exchanges
from tendon_newton.diagnosis.search.floors import floors_of
from tendon_newton.diagnosis.search.pool import Pool
from tendon_newton.diagnosis.search.refit import (
    Fit,
    refit,
    rescored,
    start_fits,
    surprise,
    values_of,
    without,
)
from tendon_newton.diagnosis.search.starts import Start, new_starts, related_starts, start_of
from tendon_newton.diagnosis.search.survey import Survey, survey

SETS, SINGLES = 6, 5  # Different sets, and single causes, that are refitted after a survey
RIVALS = 3  # Effects that are tried in the place of each cause
SETTLED = 10
"""Further steps after which a single cause has settled at the latest: it takes few simulations."""
ABSORBED = 2.0
"""Surprise of stated numbers from which they may stand for a cause [nat]: one is two tolerances
off, as far as it may be."""
ROUNDS = 6  # Surveys at most, each from the best fit so far


def find(
    pool: Pool,
    fit_columns: Sequence[int],
    names: Sequence[str],
    progress: Callable[[str], None] = lambda _: None,
) -> Fit:
    """Find the set of causes that recordings ask for, before it is pruned.

    Args:
        pool: Takes all fits.
        fit_columns: Numbers that are free without any cause.
        names: Effects that may be named.
        progress: Told what stands so far.
    """
    study = pool.worlds.study
    start = start_fits(
        pool.worlds, [((), {c: study.base_value(c) for c in fit_columns})], pool.floors
    )
    pool.add(refit(pool.worlds, start, pool.floors, iterations=8))
    return grow(pool, names, progress)


def grow(
    pool: Pool, names: Sequence[str], progress: Callable[[str], None], *, anywhere: bool = False
) -> Fit:
    """Add causes to the best set of a pool as long as a round brings what a number must.

    Args:
        pool: Has a set and takes all fits.
        names: Effects that may be named.
        progress: Told what stands so far.
        anywhere: Whether what is left in some rows counts where something sticks, too.
    """
    current = pool.best()
    for step in range(ROUNDS):
        pool.log(f"round {step}: %s; {pool.worlds.count} simulated", current)
        if pool.leaves_nothing(current, anywhere=anywhere) or pool.is_late:
            break
        if current.names:
            progress(f"so far {', '.join(current.names)}")
        add_sets(pool, current, names, first=not current.names)
        before, current = current, pool.best()
        if current is before:
            break
        current = shed(pool, current)
        pool.renew(current)
        current = pool.best()
        (old,) = rescored(pool.worlds, [before], pool.floors)
        if pool.cost(old) - pool.cost(current) < pool.price_share * pool.price:
            break
    return current


def go_on_all_rows(
    pool: Pool, fit: Fit, whole: Pool, names: Sequence[str], progress: Callable[[str], None]
) -> bool:
    """Look further on all rows where something is left there.

    Args:
        pool: Sets fitted on the beginnings.
        fit: What was found there.
        whole: Takes fits of all rows.
        names: Effects that may be named.
        progress: Told what stands so far.

    Returns:
        Whether other causes were found there.
    """
    is_more = whole.worlds.where.block_count > pool.worlds.where.block_count
    if not is_more or pool.is_late:
        return False
    likely = (pool.fits[frozenset()], fit, *nearly_worth(pool, fit, whole.price_share))
    starts = [(f.names, values_of(pool.worlds, f.columns, f.place))
              for f in {f.names: f for f in likely}.values()]  # fmt: skip
    whole.floors = floors_of(whole.worlds, fit.names)
    found = start_fits(whole.worlds, starts, whole.floors, near=True)
    whole.add(refit(whole.worlds, found, whole.floors, iterations=4, coarse=0))
    best = grow(whole, names, progress, anywhere=True)
    return frozenset(best.names) != frozenset(fit.names)


def nearly_worth(pool: Pool, fit: Fit, share: float) -> list[Fit]:
    """Return the best sets of one cause more that bring a share of its price.

    More rows may tell more of it: where it acts, and from what else it differs.
    """
    near = []
    for other in pool.fits.values():
        more = frozenset(other.names) - frozenset(fit.names)
        if len(more) == 1 and len(other.names) > len(fit.names):
            (name,) = more
            if pool.gain(other, fit) >= share * pool.bar(name):
                near.append(other)
    return sorted(near, key=pool.cost)[:RIVALS]


def add_sets(pool: Pool, current: Fit, names: Sequence[str], *, first: bool) -> None:
    """Look around a fit, choose different sets, and refit each jointly."""
    view = survey(pool.worlds, current, names, pool.floors, coarse=first)
    chooser = Chooser(view, pool.price_share * pool.price, pool.most)
    note_singles(pool, chooser, first=first)
    if first and one_is_enough(pool, view, chooser, names):
        return
    trials = choose(chooser, SETS)
    starts = related_starts(pool, current, names)
    starts += new_starts(pool, view, trials if first else [*trials, *exchanges(chooser, RIVALS)])
    follow(pool, view, starts, coarse=2 if first else 1)


def one_is_enough(pool: Pool, view: Survey, chooser: Chooser, names: Sequence[str]) -> bool:
    """Refit single causes, and tell whether one leaves nothing."""
    starts = new_starts(pool, view, chooser.singles(SINGLES))
    singles = follow(pool, view, starts, coarse=2, last=SETTLED)
    alike = [s for fit in singles[:RIVALS] for s in related_starts(pool, fit, names)]
    if alike and not pool.leaves_nothing(singles[0]):
        found = follow(pool, view, alike, coarse=1, last=SETTLED)
        singles = sorted([*singles, *found], key=pool.cost)
    if any(pool.leaves_nothing(fit) for fit in singles[:1]):
        return True
    if surprise(pool.worlds, view.fit) <= ABSORBED:
        return False
    return any(pool.leaves_nothing(f) for f in singles_from_stated(pool, view.fit, names)[:1])


def singles_from_stated(pool: Pool, fit: Fit, names: Sequence[str]) -> list[Fit]:
    """Refit single causes from where all is as it is stated, the best first.

    A model without causes puts what it can on numbers that have a tolerance. What it moved there
    hides the cause, and leads a refit of it astray.
    """
    worlds = pool.worlds
    values = values_of(worlds, fit.columns, fit.place)
    stated = {c: worlds.study.base_value(c) for c in fit.columns if c in worlds.built_columns}
    (start,) = start_fits(worlds, [((), {**values, **stated})], pool.floors)
    view = survey(worlds, start, names, pool.floors, coarse=True)
    chooser = Chooser(view, pool.price_share * pool.price, pool.most)
    starts = [start_of(pool, view, trial) for trial in chooser.singles(SINGLES)]
    return follow(pool, view, starts, coarse=2, last=SETTLED)


def note_singles(pool: Pool, chooser: Chooser, *, first: bool) -> None:
    """Keep what a survey says of each effect alone, for the account of it."""
    columns, start = chooser.survey.columns, chooser.solve((), ())
    best = chooser.best_atoms()
    pool.added = {name: start.score - trial.score for name, trial in best.items()}
    if not first:
        return
    table = pool.worlds.study.table
    for name, trial in best.items():
        numbers = {
            table.owners[c][1].name: float(v) for c, v in columns[trial.added[0]].values.items()
        }
        pool.singles[name] = (1.0 - float(np.exp(2.0 * (trial.score - start.score))), numbers)


def shed(pool: Pool, fit: Fit) -> Fit:
    """Return a fit without the causes that are worth less than their price as they stand.

    Others may take their place when all that is left is refitted, so that they are worth no more.
    """
    while fit.names:
        without_each = [without(fit, name, pool.worlds) for name in fit.names]
        less = start_fits(pool.worlds, without_each, pool.floors, near=True)
        worths = {n: f.score - fit.score - pool.price_share * pool.bar(n)
                  for n, f in zip(fit.names, less, strict=True)}  # fmt: skip
        name = min(worths, key=lambda n: worths[n])
        if worths[name] >= 0.0:
            break
        rest = less[fit.names.index(name)]
        pool.add(refit(pool.worlds, [rest], pool.floors, iterations=2, coarse=0))
        fit = pool.fits[frozenset(rest.names)]
    return fit


def follow(
    pool: Pool, view: Survey, starts: Sequence[Start], *, coarse: int, last: int = 2
) -> list[Fit]:
    """Refit sets jointly, following fewer the longer it takes; add them, best first.

    The best of several starts of one set is followed.

    Args:
        pool: Takes all fits.
        view: View of the fit that all starts are near.
        starts: Sets and the values to start from.
        coarse: First steps at the scale of all residuals.
        last: Steps at most of those that are followed furthest.
    """
    found = start_fits(pool.worlds, starts, pool.floors, slopes=view.slopes)
    found.sort(key=lambda fit: -fit.score)
    fits = list({frozenset(fit.names): fit for fit in found}.values())
    for count in pool.followed:
        if pool.is_late:
            break
        fits.sort(key=pool.cost)
        steps = last if count == pool.followed[-1] else 2
        chosen = fits[:count]
        fits[:count] = refit(pool.worlds, chosen, pool.floors, iterations=steps, coarse=coarse)
        coarse = 0
    fits.sort(key=pool.cost)
    for fit in fits:
        pool.log("    %s", fit)
    pool.add(fits)
    return fits
