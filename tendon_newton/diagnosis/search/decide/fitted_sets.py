"""Numbers of sets of causes with intervals, all of them uncertain together."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.special import chdtri

from tendon_newton.data.recording import Array
from tendon_newton.diagnosis.findings import Found
from tendon_newton.diagnosis.posterior import SURE, FittedSet, OpenNumber, Posterior
from tendon_newton.diagnosis.search.coordinates import is_shape
from tendon_newton.diagnosis.search.pool import Pool
from tendon_newton.diagnosis.search.refit import (
    Fit,
    bounds_of,
    linearise,
    rows_of,
    values_of,
)
from tendon_newton.diagnosis.search.search_worlds import SearchWorlds
from tendon_newton.effects import special_cases
from tendon_newton.identification.intervals import (
    LEAST_SHARE,
    SHARED_FORM,
    correlations,
    half_widths,
    rows_together,
)
from tendon_newton.identification.linearisation import Linearisation
from tendon_newton.identification.study import Study

AT_END = 0.01
"""Share of a range that counts as its end [1]: a rigid string is written as the stiffest one."""
LEAST_APART = 1.0e-6
"""Least variance of a combination of numbers, each alone having one [1]; less is rounding."""
NUDGE = 1.0e-6  # Change of a coordinate by which others in another clock are differentiated [1]
LEAST_WEIGHT, MOST_SETS = 0.02, 8
"""Sets with a smaller share of the weight [1], and beyond so many, are no part of the posterior."""


def found_of(pool: Pool, fit: Fit, *, refused: Collection[str] | None = None) -> Found:
    """Return a fit's numbers with 95 % intervals out of the joint fit.

    Intervals are symmetric in coordinates in which a limit that is infinite when absent lies at
    zero.

    Args:
        pool: Has the fits of all rows.
        fit: The set.
        refused: Causes that failed on unseen parts. What all sets without them say of the same
            numbers widens the intervals, as the variance between sets is added to that within one
            (Hoeting et al., Bayesian model averaging: a tutorial, 1999). The covariance stays that
            of the set alone. By default no other set is asked.
    """
    worlds = pool.worlds
    jacobian = two_sided(worlds, fit) @ clock_slopes(worlds, fit)
    rows = rows_of(worlds, fit, pool.floors)
    point = Linearisation(
        residual=fit.residual / rows.unit, jacobian=jacobian / rows.unit[:, None],
        weight=rows.weight,
    )  # fmt: skip
    spread = worlds.spreads(fit.columns, fit.names)
    form = share_of_form(worlds, fit)
    half = half_widths(point, worlds.where, spread, form)
    weights = {} if refused is None else weights_of(pool, point, fit, refused)
    among = [(in_seconds(worlds, pool.fits[key]), weight) for key, weight in weights.items()]
    fit = in_seconds(worlds, fit)
    values = values_of(worlds, fit.columns, fit.place)
    whole = np.hypot(half, [between(worlds, fit, c, among) for c in fit.columns])
    low, high = bounds_of(worlds, fit.columns, fit.names)
    intervals, numbers = {}, list[OpenNumber]()
    for f, (column, value) in enumerate(values.items()):
        coordinate = worlds.coordinate(column)
        ends = (max(low[f], fit.place[f] - whole[f]), min(high[f], fit.place[f] + whole[f]))
        found = sorted(coordinate.value(float(u)) for u in ends)
        slack = form * LEAST_SHARE * abs(value) if np.isfinite(value) else 0.0
        parameter = worlds.study.parameter(column)
        intervals[column] = (
            max(found[0] - slack, min(parameter.lower, value)),
            min(found[1] + slack, max(parameter.upper, value)),
        )
        half[f] += abs(coordinate.place((1.0 + form * LEAST_SHARE) * value) - fit.place[f])
        own = replace(coordinate, lower=float(low[f]), upper=float(high[f]))
        owner, name = worlds.study.table.owners[column][0], parameter.name
        numbers.append(
            OpenNumber(owner=owner, name=name, coordinate=own, place=float(fit.place[f]))
        )
    spreads = half / SURE
    return Found(
        effects=fit.names,
        values=values,
        intervals=intervals,
        point=point,
        numbers=tuple(numbers),
        covariance=correlations(point, worlds.where, spread, form) * np.outer(spreads, spreads),
    )


def share_of_form(worlds: SearchWorlds, fit: Fit) -> float:
    """Return the share of a fit's squared residuals that is error of form and no noise [1].

    On a path that is led all of an error of form is among the residuals of its own row. Where
    motions are simulated its size is not known, and what is left says nothing against one.
    """
    if not worlds.study.is_led:
        return 1.0
    noise, shares = worlds.study.noise, [0.0]
    for signal, rows in worlds.where.signals:
        left = float(np.mean(fit.residual[rows] ** 2))
        shares.append(1.0 - noise.of(signal) ** 2 / left if left > 0.0 else 0.0)
    return max(shares)


def two_sided(worlds: SearchWorlds, fit: Fit) -> Array:
    """Return the derivatives of a fit's residuals by its coordinates, shape (M, F).

    What sticks or stops one row earlier gives one side a difference as large as its step is short.
    Such a row tells nothing of a number: the harmonic mean of both sides is at most twice the
    smaller one, and nothing where they differ in sign.

    Source: van Leer, Towards the ultimate conservative difference scheme II (1974).
    """
    sides = list[Array]()
    for side in (1.0, -1.0):
        worlds.bench_slopes = {}
        sides += linearise(worlds, [replace(fit, stride=side * fit.stride, slopes={})])
    worlds.bench_slopes = {}
    return harmonic(*sides)


def harmonic(one: Array, other: Array) -> Array:
    """Return the harmonic mean of numbers, and nothing where their signs differ."""
    product, total = one * other, one + other
    return np.divide(2.0 * product, total, out=np.zeros_like(total), where=product > 0.0)


def between(
    worlds: SearchWorlds, fit: Fit, column: int, among: Collection[tuple[Fit, float]]
) -> float:
    """Return half the 95 % interval of a number's coordinate over sets that fitted it, too.

    A number of a bench that is a cause in one set and within its tolerance in another is not the
    same number. A set in which a cause ended as nothing is one without it.
    """
    owner, own = worlds.study.table.owners[column][0], fit.place[fit.columns.index(column)]
    is_nothing = worlds.coordinate(column).is_nothing
    moved = [
        (o.place[o.columns.index(column)] - own, weight) for o, weight in among
        if column in o.columns and (owner in o.names) == (owner in fit.names)
        and not (owner in o.names and is_nothing(o.place[o.columns.index(column)]))
    ]  # fmt: skip
    off, weights = np.reshape(moved, (-1, 2)).T
    total = weights.sum()  # none where all other sets are far behind
    return SURE * float(np.sqrt(weights @ off**2 / total)) if total > 0.0 else 0.0


def in_seconds(worlds: SearchWorlds, fit: Fit) -> Fit:
    """Return a fit with the coordinates of its numbers in seconds, not in the log's clock."""
    values = worlds.in_seconds(values_of(worlds, fit.columns, fit.place))
    return replace(fit, place=np.array([worlds.coordinate(c).place(v) for c, v in values.items()]))


def clock_slopes(worlds: SearchWorlds, fit: Fit) -> Array:
    """Return how a fit's coordinates change with those in seconds, shape (F, F)."""
    nudges = NUDGE * np.eye(len(fit.columns))
    moved = [in_seconds(worlds, replace(fit, place=fit.place + nudge)).place for nudge in nudges]
    slopes = (np.reshape(moved, nudges.shape) - in_seconds(worlds, fit).place) / NUDGE
    return np.linalg.inv(slopes.T).astype(np.float64)


def strengths(study: Study, name: str) -> list[int]:
    """Return the columns of the numbers of a cause without which there is none."""
    columns = study.table.columns(name)
    own = [(c, study.parameter(c)) for c in columns]
    shaped = [c for c, p in own if not is_shape(p) and p.name != "position"]
    return shaped if len(own) > 1 else list(columns)


def holds_null(study: Study, found: Found, name: str) -> bool:
    """Tell whether the values that mean none lie in the intervals of all strengths of a cause.

    They must lie in the 95 % region of all strengths together as well: two forces may each be open
    though their difference is sure. Places, times and speeds that only shape a cause of several
    numbers do not count.
    """
    own = [(study.parameter(c), c) for c in strengths(study, name)]
    ends = [(p, *found.intervals[c]) for p, c in own]
    alone = all(high >= (1.0 - AT_END) * p.upper if np.isinf(p.null) else low <= p.null <= high
                for p, low, high in ends)  # fmt: skip
    return alone and (len(own) == 1 or none_together(found, [(c, p.null) for p, c in own]))


def is_within(decisive: Pool, found: Found, name: str) -> bool:
    """Tell whether the interval of a stated number reaches what is stated, a tolerance off."""
    worlds, (column,) = decisive.worlds, decisive.worlds.study.table.columns(name)
    stated, spread = worlds.stated_at(column)
    ends = [worlds.coordinate(column).place(value) for value in found.intervals[column]]
    return min(ends) <= stated + spread and max(ends) >= stated - spread


def none_together(found: Found, nulls: Sequence[tuple[int, float]]) -> bool:
    """Tell whether values of several numbers, by column, lie in their common 95 % region.

    It is as wide for each as the number's own interval, which other sets may have widened. A number
    that is held, or whose interval has no end, says nothing.
    """
    at = [list(found.values).index(column) for column, _ in nulls]
    numbers = [found.numbers[k] for k in at]
    off = np.array([n.place - n.coordinate.place(null)
                    for n, (_, null) in zip(numbers, nulls, strict=True)])  # fmt: skip
    half = np.array([max(abs(n.coordinate.place(end) - n.place) for end in found.intervals[column])
                     for n, (column, _) in zip(numbers, nulls, strict=True)])  # fmt: skip
    covariance = found.covariance[np.ix_(at, at)]
    spread = np.sqrt(np.diag(covariance))
    says = np.isfinite(off) & np.isfinite(half) & np.isfinite(spread) & (spread > 0.0)
    off = off[says] / np.maximum(half[says] / SURE, spread[says])
    shared = covariance[np.ix_(says, says)] / np.outer(spread[says], spread[says])
    sizes, ways = np.linalg.eigh(shared)
    distance = np.square(ways.T @ off) @ (1.0 / np.maximum(sizes, LEAST_APART))
    return bool(distance <= chdtri(max(len(off), 1), 0.05))


def weights_of(
    pool: Pool, point: Linearisation, fit: Fit, refused: Collection[str]
) -> dict[frozenset[str], float]:
    """Return the weights of all fitted sets, which are one together [1].

    A weight comes from the likelihood, in which several dependent rows count as one, and from the
    price of each number. Errors of form are shared by blocks of time. They widen intervals, and
    weaken what the rows say between sets as much.

    Args:
        pool: Has the fits of all rows.
        point: The answer around its optimum.
        fit: The answer's set as it was fitted.
        refused: Causes that failed on unseen parts: sets that hold one have no weight.
    """
    rows = max(int(own.sum()) for _, own in pool.worlds.where.signals)
    telling = rows / rows_together(point, pool.worlds.where) / SHARED_FORM**2
    costs = {key: telling * (pool.cost(other) - pool.cost(fit))
             for key, other in pool.fits.items() if not key & set(refused)}  # fmt: skip
    least = min(costs.values())
    weights = {key: float(np.exp(least - cost)) for key, cost in costs.items()}
    total = sum(weights.values())
    return {key: weight / total for key, weight in weights.items()}


def probability(
    weights: Mapping[frozenset[str], float], name: str, rivals: Collection[str]
) -> float:
    """Return the weight of all sets that hold a cause, or one of its class [1]."""
    return sum(weight for key, weight in weights.items() if key & {name, *rivals})


def posterior_of(
    pool: Pool,
    found: Found,
    fit: Fit,
    weights: Mapping[frozenset[str], float],
    alike: Mapping[frozenset[str], Found],
) -> Posterior:
    """Return the sets that have weight, each around its own optimum.

    Where the answer has the special case of a law, sets with that law are left out: it explains no
    more than errors of form would, and motions that no recording has seen show what it is wrong in.

    Args:
        pool: Has the fits of all rows.
        found: The answer.
        fit: The answer's set as it was fitted.
        weights: Weights of all fitted sets.
        alike: Sets with a cause in the place of one of its class. An experiment tells them apart,
            so they are kept with whatever weight they have, but for laws as above.
    """
    answer, sets = frozenset(fit.names), list[FittedSet]()
    plain = {k: w for k, w in weights.items() if not holds_law_of(answer, k)}
    least = LEAST_WEIGHT * sum(plain.values())
    kept = sorted((k for k, w in plain.items() if w >= least), key=lambda k: -plain[k])
    told = [key for key in alike if plain.get(key, 0.0) > 0.0]
    for key in dict.fromkeys((*kept[:MOST_SETS], *told)):
        own = found if key == answer else alike.get(key) or found_of(pool, pool.fits[key])
        sets.append(
            FittedSet(
                weight=weights[key],
                causes=own.effects,
                numbers=own.numbers,
                covariance=own.covariance,
            )
        )
    return Posterior(sets=tuple(sets))


def holds_law_of(answer: frozenset[str], names: frozenset[str]) -> bool:
    """Tell whether a set has a law of which an answer has the special case."""
    return any(not answer.isdisjoint(special_cases(name)) for name in names - answer)
