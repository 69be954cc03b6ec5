"""From a survey to a set of causes: choose, refit jointly, look again from there."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from tendon_newton.diagnosis.search.choice import Chooser, Trial, choose, exchanges
from tendon_newton.diagnosis.search.coordinates import is_shape
from tendon_newton.diagnosis.search.floors import floors_of
from tendon_newton.diagnosis.search.pool import Pool
from tendon_newton.diagnosis.search.refit import Fit, refit, start_fits
from tendon_newton.diagnosis.search.survey import Survey, survey

ROUGH_STEP = 1.0e-3
"""Simulation step [s] while sets are chosen."""
SETS, SINGLES = 6, 5
"""Different sets, and single causes, that are refitted after a survey."""
RIVALS = 3
"""Effects that are tried in the place of each cause."""
FOLLOWED = (12, 6, 3)
"""Sets that are followed ever further, after one look and after each two steps of their refit."""
ROUNDS = 6
"""Surveys at most, each from the best fit so far."""


def find(
    pool: Pool,
    fit_columns: Sequence[int],
    names: Sequence[str],
    known: Sequence[str],
    progress: Callable[[str], None] = lambda _: None,
) -> Fit:
    """Find the set of causes that recordings ask for, before it is pruned.

    Args:
        pool: Takes all fits.
        fit_columns: The model's own unknown numbers.
        names: Effects that may be named.
        known: Effects of the starting model.
        progress: Told what stands so far.
    """
    study = pool.worlds.study
    start = start_fits(
        pool.worlds, [((), {c: study.base_value(c) for c in fit_columns})], pool.floors, ROUGH_STEP
    )
    pool.add(refit(pool.worlds, start, pool.floors, iterations=8))
    current = pool.best()
    for step in range(ROUNDS):
        pool.log(f"round {step}: {pool.describe(current)}; {pool.worlds.count} simulated")
        if pool.excess(current) < pool.price or pool.is_late:
            break
        if step:
            progress(f"so far {', '.join(current.names)}")
        add_sets(pool, current, names, first=step == 0)
        before, current = current, pool.best()
        if current is before:
            break
        pool.renew(floors_of(pool.worlds, (*known, *current.names)), current)
        before, current = pool.fits[frozenset(before.names)], pool.best()
    return current


def add_sets(pool: Pool, current: Fit, names: Sequence[str], *, first: bool) -> None:
    """Look around a fit, choose different sets, and refit each jointly."""
    view = survey(pool.worlds, current, names, pool.floors, 1.0 if first else 0.99)
    chooser = Chooser(view, pool.haste * pool.price, pool.most)
    note_singles(pool, chooser, first=first)
    trials = choose(chooser, SETS)
    trials += chooser.singles(SINGLES) if first else exchanges(chooser, RIVALS)
    starts = new_starts(pool, view, trials)
    fits = start_fits(pool.worlds, starts, pool.floors, current.time_step)
    for fit in follow(pool, fits, coarse=2 if first else 1):
        pool.log(f"    {pool.describe(fit)}")


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
        pool.alone[name] = (1.0 - float(np.exp(2.0 * (trial.score - start.score))), numbers)


def new_starts(
    pool: Pool, view: Survey, trials: Sequence[Trial]
) -> list[tuple[tuple[str, ...], dict[int, float]]]:
    """Return causes and values to start from of those sets that were not fitted yet."""
    starts: dict[frozenset[str], tuple[tuple[str, ...], dict[int, float]]] = {}
    for trial in trials:
        names, values = start_of(pool, view, trial)
        if frozenset(names) not in pool.fits:
            starts.setdefault(frozenset(names), (names, values))
    return list(starts.values())


def start_of(pool: Pool, view: Survey, trial: Trial) -> tuple[tuple[str, ...], dict[int, float]]:
    """Return a set's causes and the values to start its fit from, column -> value."""
    worlds, fit = pool.worlds, view.fit
    gone = {c for name in trial.removed for c in worlds.study.table.columns(name)}
    place = dict(zip(fit.columns, fit.place, strict=True))
    for i, x in trial.coefficients.items():
        if view.columns[i].kind == "slope":
            place = {c: u + x * view.columns[i].values.get(c, 0.0) for c, u in place.items()}
    values = {c: worlds.coordinate(c).value(float(u)) for c, u in place.items() if c not in gone}
    names = [n for n in fit.names if n not in trial.removed]
    for i in trial.added:
        names.append(view.columns[i].name)
        for c, value in view.columns[i].values.items():
            parameter, own = worlds.study.parameter(c), worlds.coordinate(c)
            shapes = len(view.columns[i].values) > 1 and is_shape(parameter)
            if not shapes and parameter.name != "position":
                u = float(np.clip(trial.coefficients[i] * own.place(value), own.lower, own.upper))
                value = own.value(u)
            values[c] = value
    return tuple(names), values


def follow(pool: Pool, fits: list[Fit], *, coarse: int) -> list[Fit]:
    """Refit sets jointly, following fewer the longer it takes; add them, best first."""
    for count in FOLLOWED:
        if pool.is_late:
            break
        fits.sort(key=pool.cost)
        fits[:count] = refit(pool.worlds, fits[:count], pool.floors, iterations=2, coarse=coarse)
        coarse = 0
    fits.sort(key=pool.cost)
    pool.add(fits)
    return fits
