"""Numbers of a set of causes with intervals, all of them uncertain together."""

from __future__ import annotations

from collections.abc import Sequence

from tendon_newton.diagnosis.findings import Found
from tendon_newton.diagnosis.search.coordinates import is_shape
from tendon_newton.diagnosis.search.pool import Pool
from tendon_newton.diagnosis.search.refit import (
    LAST_SHARE,
    Fit,
    bounds_of,
    linearise,
    row_units,
    values_of,
)
from tendon_newton.identification.intervals import LEAST_SHARE, half_widths
from tendon_newton.identification.linearisation import Linearisation


def found_of(pool: Pool, fit: Fit) -> Found:
    """Return a fit's numbers with 95 % intervals out of the joint fit.

    Blocks of time and whole recordings are drawn with replacement and all numbers refitted to first
    order, in coordinates in which a limit that is infinite when absent lies at zero.
    """
    worlds = pool.worlds
    worlds.bench_slopes = {}
    (jacobian,) = linearise(worlds, [fit])
    unit = row_units(worlds, fit, pool.floors, LAST_SHARE, None)
    point = Linearisation(residual=fit.residual / unit, jacobian=jacobian / unit[:, None])
    values = values_of(worlds, fit.columns, fit.place)
    half = half_widths(point, worlds.where)
    low, high = bounds_of(worlds, fit.columns)
    intervals = {}
    for f, (column, value) in enumerate(values.items()):
        coordinate = worlds.coordinate(column)
        ends = (max(low[f], fit.place[f] - half[f]), min(high[f], fit.place[f] + half[f]))
        found = sorted(coordinate.value(float(u)) for u in ends)
        slack = LEAST_SHARE * abs(value)
        parameter = worlds.study.parameter(column)
        intervals[column] = (
            max(found[0] - slack, min(parameter.lower, value)),
            min(found[1] + slack, max(parameter.upper, value)),
        )
    return Found(effects=fit.names, values=values, intervals=intervals, point=point)


def left_open(pool: Pool, fit: Fit, names: Sequence[str]) -> list[str]:
    """Return those of some causes whose strengths the data leave as open as their ranges.

    Places, times and speeds that only shape a cause of several numbers do not count.
    """
    if not names:
        return []
    intervals, study = found_of(pool, fit).intervals, pool.worlds.study
    out = []
    for name in names:
        own = [(study.parameter(c), intervals[c]) for c in study.table.columns(name)]
        strengths = [(p, ends) for p, ends in own if not is_shape(p) and p.name != "position"]
        chosen = own if len(own) == 1 else strengths
        if all(low <= p.lower and high >= p.upper for p, (low, high) in chosen):
            out.append(name)
    return out
