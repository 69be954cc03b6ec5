"""Where refits of sets start: at what a survey predicts, where they stood, or at a special case."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tendon_newton.diagnosis.search.choice import Trial
from tendon_newton.diagnosis.search.coordinates import atoms, is_shape
from tendon_newton.diagnosis.search.pool import Pool
from tendon_newton.diagnosis.search.refit import Fit, values_of
from tendon_newton.diagnosis.search.survey import Survey
from tendon_newton.effects import are_one_law, special_cases

Start = tuple[tuple[str, ...], dict[int, float]]
"""Causes and the values to start from, column -> value."""


def new_starts(pool: Pool, view: Survey, trials: Sequence[Trial]) -> list[Start]:
    """Return starts of sets that a survey promises; a fit that did not settle goes on."""
    starts: dict[frozenset[str], Start] = {}
    for trial in trials:
        names, values = start_of(pool, view, trial)
        starts.setdefault(frozenset(names), (names, values))
    for key in list(starts):
        fit = pool.fits.get(key)
        if fit is not None and fit.settled:
            del starts[key]
        elif fit is not None:
            starts[key] = (fit.names, values_of(pool.worlds, fit.columns, fit.place))
    return list(starts.values())


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
            if not shapes and parameter.name != "position":
                u = float(np.clip(trial.coefficients[i] * own.place(value), own.lower, own.upper))
                value = own.value(u)
            values[c] = value
    return tuple(names), values


def related_starts(pool: Pool, fit: Fit, allowed: Sequence[str]) -> list[Start]:
    """Return starts of sets in which a relative stands in the place of a cause.

    Relatives are the special cases of a law, the laws that include it, and those that include one
    of its special cases. The first of them that fits a little better need not be the right one. A
    relative starts where it does the same: its numbers of a unit are the cause's first of that
    unit, and others have each of their typical values. One that fits no worse already is left.
    An effect of one servo and that of all are relatives too.
    """
    study, out = pool.worlds.study, list[Start]()
    place = values_of(pool.worlds, fit.columns, fit.place)
    for name in fit.names:
        own = study.table.columns(name)
        by_unit = {study.parameter(c).unit: place[c] for c in reversed(own) if c in place}
        rest = {c: v for c, v in place.items() if c not in own}
        out += starts_of_servos(pool, fit, name, allowed)
        alike = {name, *special_cases(name)}
        for relative in allowed:
            if alike.isdisjoint({relative, *special_cases(relative)}):
                continue
            names = (*(n for n in fit.names if n != name), relative)
            known = pool.fits.get(frozenset(names))
            if relative in fit.names or (known is not None and known.score <= fit.score):
                continue
            for atom in atoms(study, relative):
                numbers = {c: study.parameter(c) for c in atom}
                same = {c: by_unit[p.unit] for c, p in numbers.items()
                        if p.unit in by_unit and not is_shape(p)}  # fmt: skip
                out.append((names, {**rest, **atom, **same}))
    return list({(n, *v.items()): (n, v) for n, v in out}.values())


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
