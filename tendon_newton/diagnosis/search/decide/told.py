"""An answer as it is told: one law of a friction, what is sure, and stated numbers that are off."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from tendon_newton.diagnosis.search.coordinates import inside
from tendon_newton.diagnosis.search.decide.decision import (
    PREDICTORS,
    Decided,
    at_bound,
    followed,
    held_out_gains,
    special_case_or_without,
    with_worths,
)
from tendon_newton.diagnosis.search.decide.fitted_sets import found_of, holds_null, is_within
from tendon_newton.diagnosis.search.pool import Pool
from tendon_newton.diagnosis.search.prune import FOLLOWED, is_sharper, leave_out, prune
from tendon_newton.diagnosis.search.refit import (
    Fit,
    offsets,
    refit,
    start_fits,
    values_of,
    without,
)
from tendon_newton.diagnosis.search.rule import SURE
from tendon_newton.diagnosis.search.search_worlds import WITHIN
from tendon_newton.diagnosis.search.starts import Start, similar_starts
from tendon_newton.effects import are_one_friction, special_cases

EDGE = 1.0e-6  # Share of a tolerance at which a number counts as at the end of its range [1]


def as_told(decisive: Pool, decided: Decided, names: Sequence[str]) -> Decided:
    """Return an answer after all that changes what is named of it.

    Args:
        decisive: Has the fits of all rows.
        decided: The answer.
        names: Effects that may be named.
    """
    for change in (with_one_law_each, with_deserved, with_told, with_other_forces):
        decided = change(decisive, decided, names)
    return decided


def with_one_law_each(decisive: Pool, decided: Decided, names: Sequence[str]) -> Decided:
    """Return an answer in which laws of one friction do not share what one explains as well.

    Two such laws stay where both together miss by less than real friction does from either alone.

    Args:
        decisive: Has the fits of all rows.
        decided: The answer.
        names: Effects that may be named.
    """
    fit = decided.fit
    shared = [n for n in fit.names if any(are_one_friction(n, o) for o in fit.names if o != n)]
    if not shared:
        return decided
    alone = [taking_over(decisive, fit, gone, kept) for gone in shared for kept in shared
             if gone != kept and are_one_friction(gone, kept)]  # fmt: skip
    decisive.add(fits_from(decisive, alone))
    less = leave_out(decisive, fit)
    best = followed(decisive, min((less[name] for name in shared), key=decisive.cost))
    best = within_ranges(decisive, best)
    if is_sharper(decisive, fit, best):
        return decided
    gains = gains_of(decisive, best, decided.held_out)
    fewer = with_worths(replace(decided, fit=best), decisive, gains, names)
    return with_one_law_each(decisive, fewer, names)


def fits_from(decisive: Pool, starts: Sequence[Start]) -> list[Fit]:
    """Return sets refitted from starts near their optima."""
    begun = start_fits(decisive.worlds, starts, decisive.floors, near=True)
    return refit(decisive.worlds, begun, decisive.floors, iterations=FOLLOWED, coarse=0)


def within_ranges(decisive: Pool, fit: Fit) -> Fit:
    """Return a set in which laws at the edge of their ranges gave way to their special cases."""
    for name in fit.names:
        if special_cases(name) and at_bound(decisive, fit, name):
            fit = special_case_or_without(decisive, fit, name)
    return fit


def gains_of(decisive: Pool, fit: Fit, known: Mapping[str, float]) -> dict[str, float]:
    """Return what each cause is worth on parts that no number has seen, where it is not known.

    A cause that was not asked for before the time was over is worth nothing there.
    """
    new = [name for name in fit.names if name not in known]
    found = held_out_gains(decisive, fit, new) if new else {}
    return {name: known.get(name, found.get(name, 0.0)) for name in fit.names}


def taking_over(decisive: Pool, fit: Fit, gone: str, kept: str) -> Start:
    """Return a start without one of two laws of one friction: the other takes its strength over.

    Its numbers of the unit and null of the law's first grow by that, so that both begin about where
    they stood together.
    """
    study = decisive.worlds.study
    first = study.table.columns(gone)[0]
    own = values_of(decisive.worlds, fit.columns, fit.place)
    names, values = without(fit, gone, decisive.worlds)
    lost = study.parameter(first)
    for column in study.table.columns(kept):
        number = study.parameter(column)
        if (number.unit, number.null) == (lost.unit, lost.null) and column in values:
            values[column] = inside(number, values[column] + own[first])
    return names, values


def with_deserved(decisive: Pool, decided: Decided, names: Sequence[str]) -> Decided:
    """Return an answer that names what is sure where causes share it so that each may be nothing.

    It holds what is sure of an answer in which several causes may be nothing, or all. It is the
    likeliest such set that is behind by a few prices at most, and each of whose causes is surely
    something.

    Args:
        decisive: Has the fits of all rows.
        decided: The answer.
        names: Effects that may be named.
    """
    fit = decided.fit
    sure = sure_of(decisive, fit)
    left_open = len(fit.names) - len(sure)
    if not left_open or (sure and left_open == 1):
        return decided
    limit = decisive.cost(fit) + SURE * decisive.price
    near = [f for f in decisive.fits.values()
            if f is not fit and sure < set(f.names) and not set(f.names) & set(decided.refused)
            and decisive.cost(f) < limit]  # fmt: skip
    for other in sorted(near, key=decisive.cost)[:PREDICTORS]:
        own = followed(decisive, other)
        if any(at_bound(decisive, own, n) for n in own.names):
            continue
        if len(sure_of(decisive, own)) < len(own.names):
            continue
        gains = held_out_gains(decisive, own, own.names)
        if all(gains.get(n, 0.0) >= decisive.bar(n) for n in own.names):
            return with_worths(replace(decided, fit=own), decisive, gains, names)
    return decided


def sure_of(decisive: Pool, fit: Fit) -> set[str]:
    """Return the causes whose strengths, alone or together, leave out that there is none."""
    found = found_of(decisive, fit)
    return {n for n in fit.names if not holds_null(decisive.worlds.study, found, n)}


def with_told(decisive: Pool, decided: Decided, names: Sequence[str]) -> Decided:
    """Return an answer with the stated numbers among its causes that are out of their tolerances.

    They are in its model, whatever they are called. A number of which nothing is known once it is
    free stays within its tolerance: what is known of all others would be lost with it.

    Args:
        decisive: Has the fits of all rows.
        decided: The answer.
        names: Effects that may be named.
    """
    worlds, fit = decisive.worlds, decided.fit
    owners = [worlds.study.table.owners[c][0] for c in fit.columns]
    off = dict(zip(owners, np.abs(offsets(worlds, fit)).tolist(), strict=True))
    told = {name: z for name, z in off.items() if name in names and z > WITHIN - EDGE}
    values, found = values_of(worlds, fit.columns, fit.place), fit
    while told:
        (found,) = fits_from(decisive, [((*fit.names, *told), values)])
        shown, before = found_of(decisive, found), told
        told = {n: z for n, z in before.items() if not is_within(decisive, shown, n)}
        if len(told) == len(before):
            break
    if not told:
        return decided
    decisive.fits[frozenset(found.names)] = found
    found = within_ranges(decisive, found)
    free = [worlds.study.table.columns(name)[0] for name in told]
    gains = gains_of(decisive, found, dict.fromkeys(told, 0.0) | decided.held_out)
    out = with_worths(replace(decided, fit=found), decisive, gains, names)
    places = dict(zip(found.columns, found.place.tolist(), strict=True))
    stated = {c: worlds.stated_at(c) for c in free}
    sizes = (abs(places[c] - stated[c][0]) / stated[c][1] for c in free)
    return replace(out, told=dict(zip(told, sizes, strict=True)))


def with_other_forces(decisive: Pool, decided: Decided, names: Sequence[str]) -> Decided:
    """Return the answer in which all forces are others, where one costs less: see `similar_starts`.

    What a stated number hid is a scale of forces like any other once it is told.

    Args:
        decisive: Has the fits of all rows.
        decided: The answer.
        names: Effects that may be named.
    """
    allowed = [name for name in names if name not in decided.refused]
    found = fits_from(decisive, similar_starts(decisive, decided.fit, allowed))
    decisive.add(found)
    best = min((decided.fit, *found), key=decisive.cost)
    if best is decided.fit:
        return decided
    best = within_ranges(decisive, prune(decisive, best))
    gains = gains_of(decisive, best, decided.held_out)
    other = with_worths(replace(decided, fit=best, told={}), decisive, gains, names)
    return with_told(decisive, other, names)
