"""Where refits of sets start: at what a survey predicts, where they stood, or at a special case."""

from collections.abc import Collection, Sequence

import numpy as np

from tendon_newton.data.parameters import Parameter
from tendon_newton.data.servo_names import servo_of
from tendon_newton.diagnosis.search.choice import Trial
from tendon_newton.diagnosis.search.coordinates import atoms, inside, is_shape, limits
from tendon_newton.diagnosis.search.pool import Pool
from tendon_newton.diagnosis.search.refit import Fit, values_of
from tendon_newton.diagnosis.search.survey import Survey
from tendon_newton.effects import are_confused, are_one_law, are_related, special_cases

SHARES = (1.0, 2.0, 0.5)  # Multiples of a cause's number at which a relative starts [1]
CLOSE = 0.5
"""How far a scale is from right, as a share of what it was, where it is right with others [1]."""
SIMILAR = ((1, 0), (0, 1), (1, 1))
"""Whether forces grow, and tendons' travels.

What stays right is the spool in the first, servo and cell in the second, else the mechanism.
"""
Start = tuple[tuple[str, ...], dict[int, float]]
"""Causes and the values to start from, column -> value."""


def new_starts(pool: Pool, view: Survey, trials: Sequence[Trial]) -> list[Start]:
    """Return starts of sets that a survey promises; a fit that did not settle goes on.

    What a limit does is not in proportion to anything: it starts at all that the survey looked at.
    """
    starts: dict[frozenset[str], list[Start]] = {}
    for trial in trials:
        names, values = start_of(pool, view, trial)
        new = {c for i in trial.added for c in view.columns[i].values}
        starts.setdefault(frozenset(names), with_limits(pool, (names, values), new))
    for key in list(starts):
        fit = pool.fits.get(key)
        if fit is not None and fit.settled:
            del starts[key]
        elif fit is not None:
            starts[key] = [(fit.names, values_of(pool.worlds, fit.columns, fit.place))]
    return [start for same in starts.values() for start in same]


def with_limits(pool: Pool, start: Start, columns: Collection[int]) -> list[Start]:
    """Return a start, and the same at other limits for those of some columns that are limits."""
    study, (names, values) = pool.worlds.study, start
    out = [start]
    for column in columns:
        parameter = study.parameter(column)
        if np.isinf(parameter.null):
            other = [inside(parameter, x) for x in limits(study, parameter)]
            out += [(names, {**values, column: x}) for x in other]
    return out


def start_of(pool: Pool, view: Survey, trial: Trial) -> Start:
    """Return a set's causes and the values that a survey predicts for it."""
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
            if not shapes and not parameter.optional and parameter.name != "position":
                u = float(np.clip(trial.coefficients[i] * own.place(value), own.lower, own.upper))
                value = own.value(u)
            values[c] = value
    return tuple(names), values


def related_starts(
    pool: Pool, fit: Fit, allowed: Sequence[str], *, confused: bool = False
) -> list[Start]:
    """Return starts of sets in which a relative stands in the place of a cause.

    Relatives are the special cases of a law, the laws that include it, and those that include one
    of its special cases. The first of them that fits a little better need not be the right one. One
    that fits no worse already is left. An effect of one servo and that of all are relatives too.

    Args:
        pool: Has the sets that were fitted.
        fit: The set.
        allowed: Effects that may be named.
        confused: Whether effects that are easily confused with a cause count as its relatives.
    """
    out = list[Start]()
    for name in fit.names:
        out += starts_of_servos(pool, fit, name, allowed)
        alike = {name, *special_cases(name)}
        for relative in allowed:
            is_alike = not alike.isdisjoint({relative, *special_cases(relative)})
            if not is_alike and not (confused and are_confused(name, relative)):
                continue
            others = frozenset(fit.names) - {name}
            if relative in others or any(are_related(relative, other) for other in others):
                continue
            known = pool.fits.get(others | {relative})
            if relative != name and (known is None or (is_alike and known.score > fit.score)):
                out += starts_of_relative(pool, fit, name, relative)
    return list({(n, *v.items()): (n, v) for n, v in out}.values())


def starts_of_relative(pool: Pool, fit: Fit, name: str, relative: str) -> list[Start]:
    """Return starts of a set in which a relative stands in the place of a cause.

    The relative starts where it does about the same: its numbers of a unit are the cause's first of
    that unit with the same null, or twice or half of it. Others have their typical values, or bind
    least where they are limits and the cause is a special case, which knows none.
    """
    study, place = pool.worlds.study, values_of(pool.worlds, fit.columns, fit.place)
    own = study.table.columns(name)
    kinds = {c: (study.parameter(c).unit, study.parameter(c).null) for c in own}
    by_kind = {kinds[c]: place[c] for c in reversed(own) if c in place}
    rest = {c: v for c, v in place.items() if c not in own}
    names = (*(n for n in fit.names if n != name), relative)
    out = list[Start]()
    for atom in atoms(study, relative):
        numbers = {c: study.parameter(c) for c in atom}
        same = {c: p for c, p in numbers.items()
                if (p.unit, p.null) in by_kind and not is_shape(p)}  # fmt: skip
        contains = name in special_cases(relative)
        loose = {c: p.upper for c, p in numbers.items() if contains and np.isinf(p.null)}
        for share in SHARES if same else SHARES[:1]:
            alike = {c: inside(p, share * by_kind[p.unit, p.null]) for c, p in same.items()}
            out.append((names, {**rest, **atom, **loose, **alike}))
    return out


def similar_starts(pool: Pool, fit: Fit, allowed: Sequence[str]) -> list[Start]:
    """Return starts of sets with other forces or travels, whose motions and readings are the same.

    A stronger servo moves stiffer springs as far, and a load cell that reads less reads the same:
    weights and inertias alone tell them apart. On a larger spool the same turns lead further, by
    softer springs as well, or by the same ones and a stronger servo. Each scale of a force or
    travel that a set has becomes right, and what must grow with it does (`SIMILAR`): what acts on
    slow motions, or dampings too, or inertias too. What is nearly right then is dropped, and is
    kept as well where the set is no larger.

    Args:
        pool: Has the sets that were fitted.
        fit: The set.
        allowed: Effects that may be named.
    """
    study, place = pool.worlds.study, values_of(pool.worlds, fit.columns, fit.place)
    scales, values = dict[str, tuple[int, Parameter]](), dict(place)
    for name in allowed:
        (column, *others) = study.table.columns(name)
        scale, value = study.parameter(column), place.get(column, study.base_value(column))
        is_scale = not others and (scale.unit, scale.null) == ("1", 1.0) and value > 0.0
        if is_scale and (scale.force_power or scale.travel_power) and servo_of(name) is None:
            scales[name], values[column] = (column, scale), value
    numbers, out = {c: study.parameter(c) for c in values}, list[Start]()
    spools = any(s.travel_power and not s.force_power for _, s in scales.values())
    for forces, travels in SIMILAR if spools else SIMILAR[:1]:
        power = {c: forces * p.force_power + travels * p.travel_power for c, p in numbers.items()}
        moved = {name: c for name, (c, _) in scales.items() if power[c]}
        for right in (c for name, c in moved.items() if name in fit.names):
            size = values[right] ** (-1.0 / power[right])
            grown = {c: inside(p, values[c] * size ** power[c]) for c, p in numbers.items()}
            close = {n for n, c in moved.items()
                     if abs(np.log(grown[c])) <= CLOSE * abs(np.log(values[c]))}  # fmt: skip
            kept = [n for n in fit.names if n not in close]
            new = [n for n in moved
                   if n not in fit.names and not any(are_related(n, k) for k in kept)]  # fmt: skip
            also = [n for n in fit.names if n in close and moved[n] != right]
            for most in sorted({numbers[moved[n]].time_power for n in new}):
                causes = (*kept, *(n for n in new if numbers[moved[n]].time_power <= most))
                same = (*causes, *also) if len(causes) + len(also) <= len(fit.names) else causes
                for names in dict.fromkeys([causes, same]):
                    gone = {c for n in fit.names if n not in names for c in study.table.columns(n)}
                    gone |= {c for n, (c, _) in scales.items() if n not in names and c not in place}
                    if frozenset(names) not in pool.fits:
                        out.append((names, {c: v for c, v in grown.items() if c not in gone}))
    return out


def starts_of_servos(pool: Pool, fit: Fit, name: str, allowed: Sequence[str]) -> list[Start]:
    """Return starts of sets in which all servos share an effect of one, or each has its own."""
    table, out = pool.worlds.study.table, list[Start]()
    place = values_of(pool.worlds, fit.columns, fit.place)
    own = tuple(cause for cause in allowed if are_one_law(cause, name))
    sets: list[tuple[str, ...]] = [(cause,) for cause in own]
    for causes in [*sets, own] if len(own) > 1 else sets:
        names = [n for n in fit.names if not any(n == c or are_one_law(n, c) for c in causes)]
        known = pool.fits.get(frozenset((*names, *causes)))
        if known is None or known.score > fit.score:
            gone = {c for n in fit.names if n not in names for c in table.columns(n)}
            values = {c: v for c, v in place.items() if c not in gone}
            for cause in causes:
                pairs = zip(table.columns(cause), table.columns(name), strict=True)
                values |= {new: place[old] for new, old in pairs}
            out.append(((*names, *causes), values))
    return out
