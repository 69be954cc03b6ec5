"""What effects that are not named do to the numbers of those that are."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np

from tendon_newton.data.recording import Array
from tendon_newton.diagnosis.findings import Found
from tendon_newton.diagnosis.search.coordinates import atoms
from tendon_newton.diagnosis.search.decide.fitted_sets import share_of_form, strengths
from tendon_newton.diagnosis.search.pool import Pool
from tendon_newton.diagnosis.search.refit import Fit, rows_of, values_of
from tendon_newton.effects import are_related
from tendon_newton.identification.intervals import rows_together
from tendon_newton.identification.linearisation import invertible
from tendon_newton.identification.objective import loss_weights

UNNAMED = 2.0
"""Prices that an effect may be worth and go unnamed [1]: it must bring one on all rows and on parts
that no number has seen. On 28 benches of a second plant 85 and 89 % of the numbers lie inside with
1 and 2."""


def with_unnamed(
    pool: Pool,
    fit: Fit,
    found: Found,
    names: Sequence[str],
    classes: Mapping[str, Collection[str]],
    worths: Mapping[str, float],
) -> Found:
    """Return a set with intervals that hold what effects too small to be named would do.

    They say nothing on whether a cause is there, which sets without it tell. A cause that is named
    is at least as large as one that would just be worth its price.

    Args:
        pool: Has the prices.
        fit: The set as it was fitted.
        found: Its numbers with intervals, given its causes.
        names: Effects that may be there.
        classes: Effects that may stand in the place of a named one: its numbers mean something only
            where it is there, and not one of them.
        worths: What each cause is worth [prices].
    """
    study, intervals = pool.worlds.study, dict(found.intervals)
    moved = moved_by_unnamed(pool, fit, found, names, classes)
    for number, column, move in zip(found.numbers, found.values, moved, strict=True):
        own = number.coordinate
        low, high = sorted(own.place(end) for end in found.intervals[column])
        ends = number.place + np.array([-1.0, 1.0]) * np.hypot(
            [number.place - low, high - number.place], move
        )
        if number.owner in worths and column in strengths(study, number.owner):
            null = own.place(study.parameter(column).null)
            least = null + (number.place - null) / np.sqrt(max(1.0, worths[number.owner]))
            if null < number.place:
                ends[0] = max(ends[0], least)
            else:
                ends[1] = min(ends[1], least)
        ends = np.clip(ends, own.lower, own.upper)
        values = [*found.intervals[column], *(own.value(float(end)) for end in ends)]
        intervals[column] = (min(values), max(values))
    return replace(found, intervals=intervals)


def moved_by_unnamed(
    pool: Pool, fit: Fit, found: Found, names: Sequence[str], classes: Mapping[str, Collection[str]]
) -> Array:
    """Return half the 95 % intervals that effects too small to be named leave open, shape (F,).

    An effect that brings hardly its price is not named, and may be there. All numbers of the fit
    move a little to stand for it: by what the residuals along its direction project on theirs. Each
    effect counts by itself, at the size at which it would bring `UNNAMED` prices, and at most at
    that at which a survey begins.

    Source: bias by omitted variables (Greene, Econometric analysis, 4.3.2), each of which has the
    size that a test would just not have told.
    """
    worlds, point = pool.worlds, found.point
    owners = [number.owner for number in found.numbers]
    others = [n for n in names
              if n not in owners and not any(are_related(n, own) for own in fit.names)]  # fmt: skip
    if not others:
        return np.zeros(len(owners))
    values = values_of(worlds, fit.columns, fit.place)
    beside = worlds.residuals([{**values, **atoms(worlds.study, name)[0]} for name in others])
    changes = ((beside - fit.residual) / rows_of(worlds, fit, pool.floors).unit).T
    weight = point.weight * loss_weights(point.residual)
    stated = rows_together(point, worlds.where) / worlds.spreads(fit.columns, fit.names) ** 2
    shared = point.jacobian.T @ (weight[:, None] * changes)
    moves = np.linalg.solve(invertible(point.normal_matrix() + np.diag(stated)), shared)
    left = changes - point.jacobian @ moves
    asked = np.array([pool.bar(name) for name in others]) * len(weight) / len(worlds.where.signals)
    told = np.sum(weight[:, None] * left**2, axis=0) / (2.0 * UNNAMED * asked)
    size = 1.0 / np.sqrt(np.maximum(told, 1.0))
    counts = [[name not in classes.get(owner, ()) for name in others] for owner in owners]
    return share_of_form(worlds, fit) * np.linalg.norm(counts * size * moves, axis=1)
