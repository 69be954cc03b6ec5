"""An account of every cause: what it explains alone, what it adds, and what it did not pass."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tendon_newton.diagnosis.result import CandidateScore, Criterion
from tendon_newton.diagnosis.search.coordinates import inside
from tendon_newton.diagnosis.search.decision import Decided, at_bound
from tendon_newton.diagnosis.search.pool import Pool
from tendon_newton.diagnosis.search.refit import Fit, values_of

LOSS = "score lost without it [nat per row]"
HELD_OUT = "the same on parts left out [nat per row]"
CHANGE = "larger residuals without it [errors of form of a law]"
IN_RANGE = "numbers at the edge of their ranges"
ADDED = "score that it would add to the named causes [nat per row]"


def explained_share(pool: Pool, before: Fit, after: Fit) -> float:
    """Return the share of the squared error above the floors that is gone, gaps counting alike."""
    shares = []
    for signal in ("theta", "force"):
        top, left, floor = (getattr(x, signal) for x in (before.scales, after.scales, pool.floors))
        if top > floor:
            shares.append((top**2 - left**2) / (top**2 - floor**2))
    return float(np.clip(np.mean(shares), -1.0, 1.0)) if shares else 0.0


def criteria_of(fine: Pool, fit: Fit, decided: Decided, name: str) -> tuple[Criterion, ...]:
    """Return what a cause of the final set had to pass."""
    loss, gain, edge = decided.losses[name], decided.held_out[name], at_bound(fine, fit, name)
    bar, change = fine.bar(name), decided.changes[name]
    return (
        Criterion(name=LOSS, value=loss, bar=bar, passed=loss >= bar),
        Criterion(name=HELD_OUT, value=gain, bar=bar, passed=gain >= bar),
        Criterion(name=CHANGE, value=change, bar=1.0, passed=change >= 1.0),
        Criterion(name=IN_RANGE, value=float(edge), bar=0.0, passed=not edge),
    )


def candidates(
    pool: Pool, fine: Pool, names: Sequence[str], final: Fit, decided: Decided
) -> tuple[CandidateScore, ...]:
    """Return how every effect did alone, best first, and what it passed."""
    start = pool.fits[frozenset()]
    out = []
    for name in names:
        own = pool.fits.get(frozenset({name}))
        guess = pool.alone.get(name)
        if own is not None:
            share = explained_share(pool, start, own)
            values = named_values(pool, own, name)
        else:
            share, values = (0.0, {}) if guess is None else guess
        if name in final.names:
            criteria = criteria_of(fine, final, decided, name)
        else:
            added, bar = pool.added.get(name, 0.0), pool.bar(name)
            criteria = (Criterion(name=ADDED, value=added, bar=bar, passed=added >= bar),)
        out.append(
            CandidateScore(
                name=name,
                score=share,
                values=values,
                at_bound=ended(pool, own, name),
                criteria=criteria,
                probability=decided.probabilities.get(name),
            )
        )
    return tuple(sorted(out, key=lambda c: -c.score))


def named_values(pool: Pool, fit: Fit, name: str) -> dict[str, float]:
    """Return an effect's fitted numbers by name."""
    values, table = values_of(pool.worlds, fit.columns, fit.place), pool.worlds.study.table
    return {table.owners[c][1].name: float(values[c]) for c in table.columns(name)}


def ended(pool: Pool, fit: Fit | None, name: str) -> dict[str, float]:
    """Return the numbers of an effect alone that ended at a bound but their null."""
    if fit is None or not at_bound(pool, fit, name):
        return {}
    study = pool.worlds.study
    values = values_of(pool.worlds, fit.columns, fit.place)
    out = {}
    for column in study.table.columns(name):
        parameter, value = study.parameter(column), values[column]
        edge = np.isclose(value, (parameter.lower, parameter.upper), rtol=1e-6, atol=0.0).any()
        if edge and value != parameter.null:
            out[parameter.name] = inside(parameter, float(value))
    return out
