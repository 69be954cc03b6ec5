"""Causes dropped and exchanged, each by a real refit of all others."""

from collections.abc import Sequence

import numpy as np

from tendon_newton.data.recording import Array
from tendon_newton.diagnosis.search.choice import Chooser, exchanges
from tendon_newton.diagnosis.search.floors import form_of
from tendon_newton.diagnosis.search.pool import Pool
from tendon_newton.diagnosis.search.refit import Fit, linearise, refit, start_fits, without
from tendon_newton.diagnosis.search.starts import new_starts, related_starts, similar_starts
from tendon_newton.diagnosis.search.strategy import RIVALS, follow, note_singles
from tendon_newton.diagnosis.search.survey import survey
from tendon_newton.effects import special_cases

FAR, CLEAR, KEPT = 20.0, 6.0, 2.0
"""Score lost without a cause [prices] from which it is clear. A set without it is followed if it
may fall below the second at the pace of its last step, and below the third where the question is
only whether to drop it. `decision` takes rivals below the second to all rows, and refits them there
below the first."""
FOLLOWED, AHEAD = 5, 2
"""Steps of such a set at most, and steps that show first which sets will stay clearly worse."""


def settle(pool: Pool, fit: Fit, names: Sequence[str]) -> Fit:
    """Drop causes that do not pay and exchange those that another explains better, while it pays.

    Args:
        pool: Takes all fits.
        fit: What was found.
        names: Effects that may be named.
    """
    settled: set[frozenset[str]] = set()
    gain = np.inf
    while True:
        fit = prune(pool, fit)
        pool.log(f"pruned: %s; {pool.worlds.count} simulated", fit)
        is_end = not fit.names or frozenset(fit.names) in settled or gain < pool.price
        if is_end or pool.is_late:
            return fit
        settled.add(frozenset(fit.names))
        before = pool.renew(fit)
        exchange(pool, before, names)
        fit = simplest(pool, pool.best())
        gain = pool.cost(before) - pool.cost(fit)


def prune(pool: Pool, fit: Fit) -> Fit:
    """Drop causes that do not pay, the least first; a set that was pruned before is not again."""
    begun = frozenset(fit.names)
    if begun in pool.pruned:
        return pool.fits[pool.pruned[begun]]
    while fit.names:
        less = leave_out(pool, fit, KEPT)
        worths = {n: pool.worth(fit, f, n) for n, f in less.items()}
        pool.log("    worth " + ", ".join(f"{n} {v:.2f}" for n, v in worths.items()))
        name = min(worths, key=lambda n: worths[n])
        if worths[name] >= 1.0:
            break
        fit = pool.fits[frozenset(less[name].names)]
    pool.pruned[begun] = frozenset(fit.names)
    return fit


def leave_out(pool: Pool, fit: Fit, clear: float = CLEAR) -> dict[str, Fit]:
    """Refit a set without each of its causes; what will stay clearly worse is not followed.

    A smaller set that was fitted before starts anew where the larger one leads to a better place.

    Args:
        pool: Takes all fits.
        fit: The set.
        clear: Score lost without a cause from which it is clear [prices].
    """
    starts = [without(fit, name, pool.worlds) for name in fit.names]
    less = start_fits(pool.worlds, starts, pool.floors, near=True)
    gains = np.full(len(less), np.inf)
    for i, new in enumerate(less):
        old = pool.fits.get(frozenset(new.names))
        if old is not None and old.score <= new.score:
            less[i], gains[i] = old, 0.0
    limit = fit.score + clear * pool.price
    for i, (ahead, gain) in enumerate(look_ahead(pool, fit, less)):
        if ahead.score < less[i].score:
            less[i] = ahead
        if gain > 0.0 and ahead.score - limit >= FOLLOWED * gain:
            less[i], gains[i] = ahead, 0.0
    less = follow_near(pool, less, np.full(len(less), limit), FOLLOWED, gains)
    pool.add(less)
    return {n: pool.fits[frozenset(fit.names) - {n}] for n in fit.names}


def follow_near(
    pool: Pool, fits: Sequence[Fit], limits: Array, most: int, gains: Array | None = None
) -> list[Fit]:
    """Refit sets step by step, each while it may fall below its limit at its last step's pace.

    Args:
        pool: Simulates them.
        fits: The sets.
        limits: Score below which each is of interest [nat per row], shape (N,).
        most: Steps at most.
        gains: What the last step of each brought [nat per row], shape (N,); unknown unless told.
    """
    near, gains = list(fits), np.full(len(fits), np.inf) if gains is None else gains.copy()
    for steps in range(most, 0, -1):
        far = np.array([f.score for f in near]) - limits
        going = [i for i in np.flatnonzero(far < steps * gains) if not near[i].settled]
        found = refit(pool.worlds, [near[i] for i in going], pool.floors, iterations=1, coarse=0)
        for i, after in zip(going, found, strict=True):
            gains[i], near[i] = near[i].score - after.score, after
    return near


def look_ahead(pool: Pool, fit: Fit, less: Sequence[Fit]) -> list[tuple[Fit, float]]:
    """Return where the derivatives of a set lead smaller ones, and what their last step brought.

    These steps cost little, and show which sets will stay clearly worse.
    """
    (jacobian,) = linearise(pool.worlds, [fit])
    shared = [jacobian[:, [fit.columns.index(c) for c in f.columns]] for f in less]
    before = after = list(less)
    for _ in range(AHEAD):
        before = after
        after = refit(
            pool.worlds, before, pool.floors, iterations=1, coarse=0, jacobians=shared
        )  # fmt: skip
    return [(f, old.score - f.score) for old, f in zip(before, after, strict=True)]


def exchange(pool: Pool, fit: Fit, names: Sequence[str]) -> None:
    """Refit sets in which another cause stands in the place of each.

    With other forces a set may not need all causes any more, so it is pruned if it is near.
    """
    view = survey(pool.worlds, fit, names, pool.floors)
    chooser = Chooser(view, pool.price, pool.most)
    note_singles(pool, chooser, first=False)
    starts = [
        *related_starts(pool, fit, names, confused=True),
        *new_starts(pool, view, exchanges(chooser, RIVALS)),
    ]
    follow(pool, view, starts, coarse=0)
    for similar in follow(pool, view, similar_starts(pool, fit, names), coarse=0)[:1]:
        if pool.cost(similar) < pool.cost(pool.best()) + KEPT * pool.price:
            prune(pool, similar)


def simplest(pool: Pool, fit: Fit) -> Fit:
    """Return a fit with special cases in the place of laws that explain no more.

    A law explains no more if it gains less than its further numbers cost. Nor does it if it makes
    residuals smaller by less than the error of form of the model with the special case.
    """
    for name in fit.names:
        for special in special_cases(name):
            key = (frozenset(fit.names) - {name}) | {special}
            other = pool.fits.get(key)
            if other is None:
                continue
            if pool.cost(other) <= pool.cost(fit) or not is_sharper(pool, fit, other):
                return simplest(pool, other)
    return fit


def is_sharper(pool: Pool, fit: Fit, other: Fit) -> bool:
    """Tell whether a signal's mean squares differ by that of the other model's error of form."""
    form = form_of(pool.worlds, other.names, 1.0)
    signals = zip(pool.worlds.where.signals, other.scales, fit.scales, strict=True)
    return any(
        max(0.0, less**2 - own**2) >= form.of(signal) ** 2 for (signal, _), less, own in signals
    )
