"""An account of every cause: what it explains alone, what it adds, and what it did not pass."""

from collections.abc import Mapping, Sequence

import numpy as np

from tendon_newton.diagnosis.findings import Found
from tendon_newton.diagnosis.result import CandidateScore, Criterion
from tendon_newton.diagnosis.search.coordinates import inside
from tendon_newton.diagnosis.search.decide.decision import Decided, at_bound
from tendon_newton.diagnosis.search.decide.fitted_sets import holds_null, is_within
from tendon_newton.diagnosis.search.pool import Pool
from tendon_newton.diagnosis.search.refit import Fit, values_of
from tendon_newton.diagnosis.search.rule import SURE
from tendon_newton.diagnosis.search.search_worlds import WITHIN
from tendon_newton.identification.noise_floor import share_gone

Criteria = tuple[Criterion, ...]

LOSS = "score lost without it [nat per row]"
HELD_OUT = "the same on parts left out [nat per row]"
IN_RANGE = "numbers at the edge of their ranges"
REMAINS = "score lost without it, where something is left that no cause explains [nat per row]"
BEYOND = "tolerances by which it differs from what is stated"
OPEN = "intervals of all its strengths that hold none"
ADDED = "score that it would add to the named causes [nat per row]"
BEHIND = "score by which the best set with it stays behind, causes paid for [nat per row]"
TOGETHER = "share of the squared error above the noise that the found causes leave [1]"


def explained_share(pool: Pool, before: Fit, after: Fit) -> float:
    """Return the share of the squared error above the floors that is gone, see `share_gone` [1]."""
    signals = zip(pool.worlds.where.signals, before.scales, after.scales, strict=True)
    share = share_gone((top, left, pool.floors.of(signal)) for (signal, _), top, left in signals)
    if share is None:  # what acts in few rows is seen in the tails alone
        top, left = max(0.0, pool.excess(before)), max(0.0, pool.excess(after))
        share = 1.0 - left / top if top > left else 0.0
    return share


def criteria_of(decisive: Pool, fit: Fit, decided: Decided, found: Found, name: str) -> Criteria:
    """Return what a cause of the final set had to pass; one that fails any of it is suspected.

    Where something is left that no cause explains, a law that is not in the catalogue acts, and
    what is worth little may stand for a part of it.

    Args:
        decisive: Has the fits of all rows.
        fit: The final set.
        decided: What it is worth.
        found: Numbers of the set with their intervals.
        name: The cause.
    """
    if name in decided.told:
        size, is_open = decided.told[name], is_within(decisive, found, name)
        return (
            Criterion(name=BEYOND, value=size, bar=WITHIN, passed=size >= WITHIN),
            Criterion(name=OPEN, value=float(is_open), bar=0.0, passed=not is_open),
        )
    loss, gain, edge = decided.losses[name], decided.held_out[name], at_bound(decisive, fit, name)
    bar = decisive.bar(name)
    least = 0.0 if decisive.leaves_nothing(fit, usual=True) else SURE * decisive.price
    is_open = holds_null(decisive.worlds.study, found, name)
    return (
        Criterion(name=LOSS, value=loss, bar=bar, passed=loss >= bar),
        Criterion(name=HELD_OUT, value=gain, bar=bar, passed=gain >= bar),
        Criterion(name=IN_RANGE, value=float(edge), bar=0.0, passed=not edge),
        Criterion(name=REMAINS, value=loss, bar=least, passed=loss >= least),
        Criterion(name=OPEN, value=float(is_open), bar=0.0, passed=not is_open),
    )


def refusal_of(pool: Pool, decisive: Pool, decided: Decided, name: str) -> tuple[Criterion, ...]:
    """Return what kept a cause out of the final set: a survey's promise, then real refits."""
    out, bar = [], pool.bar(name)
    if name in pool.added:  # not where it stood in the set that was looked around last
        added = pool.added[name]
        out.append(Criterion(name=ADDED, value=added, bar=bar, passed=added >= bar))
    if name in decided.refused:
        refusal = decided.refused[name]
        gain, edge = refusal.gain, refusal.at_bound
        out.append(Criterion(name=HELD_OUT, value=gain, bar=bar, passed=gain >= bar))
        out.append(Criterion(name=IN_RANGE, value=float(edge), bar=0.0, passed=not edge))
    for some in (decisive, pool):
        chosen = some.fits.get(frozenset(decided.fit.names))
        costs = [some.cost(fit) for fit in some.fits.values() if name in fit.names]
        if chosen is not None and costs:
            behind = min(costs) - some.cost(chosen)
            out.append(Criterion(name=BEHIND, value=behind, bar=0.0, passed=behind <= 0.0))
            break
    return tuple(out)


def acts_in(pool: Pool, before: Fit | None, after: Fit | None) -> tuple[str, ...] | None:
    """Return the recordings in which two fits differ by more than is left over anyway."""
    if before is None or after is None:
        return None
    worlds = pool.worlds
    floor = worlds.where.sizes(pool.floors)
    square = ((after.residual - before.residual) / floor) ** 2
    found = []
    for index, recording in enumerate(worlds.study.wholes):
        own = worlds.where.recording == index
        sizes = [square[own & rows] for _, rows in worlds.where.signals]
        if any(len(size) and size.mean() > 1.0 for size in sizes):
            found.append(recording.name)
    return tuple(dict.fromkeys(found))


def candidates(
    pool: Pool,
    decisive: Pool,
    names: Sequence[str],
    final: Fit,
    decided: Decided,
    found: Mapping[str, Criteria],
    verdict: Criterion | None = None,
) -> tuple[CandidateScore, ...]:
    """Return how every effect did alone, best first, and what it passed.

    Args:
        pool: Sets fitted on the beginnings.
        decisive: Sets fitted on all rows.
        names: Effects that were tried.
        final: What was found.
        decided: What that had to pass.
        found: What each of its causes had to pass.
        verdict: What kept all that was found from being named; None where nothing did.
    """
    start = pool.fits[frozenset()]
    out = []
    for name in names:
        own = pool.fits.get(frozenset({name}))
        guess = pool.singles.get(name)
        if own is not None:
            share = explained_share(pool, start, own)
            values = named_values(pool, own, name)
        else:
            share, values = (0.0, {}) if guess is None else guess
        if name in final.names:
            criteria = found[name]
            criteria += () if verdict is None else (verdict,)
            less = decisive.fits.get(frozenset(final.names) - {name})
            places, looked = acts_in(decisive, less, final), decisive.worlds.study
        else:
            criteria = refusal_of(pool, decisive, decided, name)
            places, looked = acts_in(pool, start, own), pool.worlds.study
        out.append(
            CandidateScore(
                name=name,
                score=share,
                values=values,
                at_bound=ended(pool, own, name),
                criteria=criteria,
                acts_in=places,
                looked_at=0 if places is None else len({r.name for r in looked.wholes}),
            )
        )
    return tuple(sorted(out, key=lambda c: -c.score))


def named_values(pool: Pool, fit: Fit, name: str) -> dict[str, float]:
    """Return an effect's fitted numbers by name."""
    values, table = values_of(pool.worlds, fit.columns, fit.place), pool.worlds.study.table
    values = pool.worlds.in_seconds(values)
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
