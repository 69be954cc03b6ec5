"""Which causes? Greedy extension, each step gated on unseen folds, then pruning and classes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tendon_newton.diagnosis.gate import (
    LEAST_SHARE,
    LEAST_T,
    SMALL_SHARE,
    Gate,
    at_bound,
    is_close,
    paired,
    simplest,
)
from tendon_newton.diagnosis.greedy import Fit, Round, Search
from tendon_newton.effects import find_effect
from tendon_newton.identification.least_squares import Candidate
from tendon_newton.identification.noise_floor import NoiseFloor
from tendon_newton.identification.objective import block_losses

MOST_CAUSES = 4
"""Causes that are looked for at once."""
MOST_SWAPS = 3
"""Causes that may be exchanged for better ones."""
LOOKED_THROUGH = 2
"""Candidates behind which a second cause is sought where none passes alone."""
CLASS_ERRORS = 2.0
"""Candidates within so many paired standard errors of the best are not told from it."""


@dataclass(frozen=True, kw_only=True)
class Attribution:
    """The causes that passed."""

    rounds: tuple[Round, ...]
    """What was tried, round by round; the first holds every effect alone."""
    baseline: Candidate
    """The starting model with its unknown numbers refitted."""
    final: Fit | None
    """All causes together; None where none passed."""
    classes: dict[str, tuple[Fit, ...]]
    """For each cause the fits with another effect in its place that explain the data as well."""
    p_value: float
    """Of the first round."""

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of the causes, strongest first."""
        return () if self.final is None else self.final.effects


def attribute(
    search: Search,
    names: Sequence[str],
    known: Sequence[str],
    noise: NoiseFloor,
    rng: np.random.Generator,
) -> Attribution:
    """Find the causes among some effects.

    Args:
        search: Fits of the training recordings.
        names: Effects that may be named.
        known: Effects that the starting model has.
        noise: Noise of the sensors.
        rng: Of the surrogates.
    """
    baseline = search.baseline()
    gate = Gate(search=search, known=known, noise=noise, baseline=baseline, rng=rng)
    rounds: list[Round] = []
    final, classes = None, {}
    while (grown := grow(gate, final, names, rounds)) is not None and grown is not final:
        final, classes = examine(gate, grown, names, rounds)
        if set(final.effects) <= set(grown.effects):
            break  # none was exchanged, so none is missing that was not tried
    return Attribution(
        rounds=tuple(rounds),
        baseline=baseline,
        final=final,
        classes=classes,
        p_value=gate.chance(rounds[0]),
    )


def grow(gate: Gate, final: Fit | None, names: Sequence[str], rounds: list[Round]) -> Fit | None:
    """Add causes one by one, or two at once, as long as they pass.

    Args:
        gate: Decides what is a finding.
        final: Causes found so far, None for none.
        names: Effects that may be named.
        rounds: What was tried, to which this adds.

    Returns:
        All causes together; what came if there is none to add.
    """
    search = gate.search
    exhausted = False
    while final is None or len(final.effects) < MOST_CAUSES:
        if final is not None and exhausted and gate.is_quiet(final):
            break
        chosen = () if final is None else final.effects
        current = gate.baseline if final is None else final.candidate
        survey = search.survey(current, chosen, [n for n in names if n not in chosen])
        if exhausted and not survey.closes:
            break
        tried = search.follow(survey)
        rounds.append(tried)
        found = simplest(tried)
        if not gate.opens(tried, found, gate.chance(tried)):
            ahead = look_ahead(gate, tried, names)
            if ahead is None:
                break
            tried, found = ahead
            rounds.append(tried)
        final = found
        exhausted = gate.is_exhausted(tried, found)
    return final


def look_ahead(gate: Gate, tried: Round, names: Sequence[str]) -> tuple[Round, Fit] | None:
    """Find two causes that close a gap together where neither passes alone.

    Two that pull in opposite ways hide each other. The answer counts only where no gap remains.
    """
    current = tried.current
    if len(current.effects) + 2 > MOST_CAUSES or gate.is_quiet(current):
        return None
    inside = [fit for fit in tried.fits if not at_bound(fit)][:LOOKED_THROUGH]
    for first in inside:
        rest = [name for name in names if name not in first.effects]
        survey = gate.search.survey(first.candidate, first.effects, rest)
        if not survey.closes:
            continue
        both = gate.search.follow(survey)
        start = gate.search.score([current.effects], [current.candidate], both.scales)[0]
        joint = replace(both, current=start)
        found = simplest(joint)
        if gate.is_quiet(found) and gate.opens(joint, found, gate.chance(joint)):
            return joint, found
    return None


def examine(
    gate: Gate, final: Fit, names: Sequence[str], rounds: Sequence[Round], swaps: int = MOST_SWAPS
) -> tuple[Fit, dict[str, tuple[Fit, ...]]]:
    """Look at each cause beside the others, and find what could stand in its place.

    Causes that later ones made redundant are dropped, and one is exchanged for another that
    explains the data better beside the rest.

    Args:
        gate: Decides what is a finding.
        final: All causes together.
        names: Effects that may be named.
        rounds: What was tried before; the first holds every effect alone.
        swaps: How many causes may be exchanged.

    Returns:
        What stands, and for each cause the fits that cannot be told from it.
    """
    search = gate.search
    if len(final.effects) == 1:
        return final, {final.effects[0]: indistinguishable(search, rounds[0], final.effects[0])}
    classes = {}
    for effect in final.effects:
        others = tuple(name for name in final.effects if name != effect)
        tried = next((r for r in rounds if extends(r, others)), None)
        if tried is None:
            candidate, _ = search.problem(others, final.candidate)
            rivals = [name for name in names if name not in others]
            tried = search.extend(candidate, others, rivals)
        if redundant(gate, tried, effect):
            return examine(gate, tried.current, names, rounds, swaps)
        if (simpler := special_case(tried, effect)) is not None:
            return examine(gate, simpler, names, rounds, swaps)
        if swaps and (better := replacement(search, tried, final, effect)) is not None:
            return examine(gate, better, names, rounds, swaps - 1)
        classes[effect] = indistinguishable(search, tried, effect)
    return final, classes


def extends(tried: Round, effects: tuple[str, ...]) -> bool:
    """Tell whether a round put one effect after another on top of some."""
    return tried.current.effects == effects == tried.fits[0].effects[:-1]


def replacement(search: Search, tried: Round, final: Fit, effect: str) -> Fit | None:
    """Return the fit with another effect in the place of one that explains clearly more."""
    own = next((fit for fit in tried.fits if fit.effects[-1] == effect), None)
    own = own or search.score([final.effects], [final.candidate], tried.scales)[0]
    best = simplest(tried)
    gain, error = paired(own.losses, best.losses)
    clear = max(error, SMALL_SHARE * (tried.current.loss - own.loss))
    return best if best.effects[-1] != effect and not at_bound(best) and gain > clear else None


def special_case(tried: Round, effect: str) -> Fit | None:
    """Return the fit with a special case of an effect in its place that explains as much."""
    own = next((fit for fit in tried.fits if fit.effects[-1] == effect), None)
    for fit in tried.fits:
        if own is not None and fit.effects[-1] in find_effect(effect).includes:
            gain = tried.current.loss - own.loss
            if is_close(fit, own, gain, 1.0):
                return fit
    return None


def redundant(gate: Gate, tried: Round, effect: str) -> bool:
    """Tell whether the others explain the data as well without a cause."""
    own = [fit for fit in tried.fits if fit.effects[-1] == effect]
    gain, error = paired(tried.current.losses, (own or tried.fits)[0].losses)
    least = LEAST_SHARE * gate.above_noise(tried, tried.current)
    return gain < max(LEAST_T * error, least)


def indistinguishable(search: Search, tried: Round, effect: str) -> tuple[Fit, ...]:
    """Return the rivals of one effect that the data cannot tell from it, nearest first."""
    own = next((fit for fit in tried.fits if fit.effects[-1] == effect), None)
    if own is None:
        return ()
    gain = tried.current.loss - own.loss
    rivals = []
    for fit in tried.fits:
        close = is_close(fit, own, gain, CLASS_ERRORS)
        contains = effect in find_effect(fit.effects[-1]).includes
        if fit is not own and close and (not contains or fits_better(search, fit, own)):
            rivals.append((fit.loss, fit))
    nearest = sorted(rivals, key=lambda rival: rival[0])
    return tuple(fit for _, fit in nearest)


def fits_better(search: Search, fit: Fit, special: Fit) -> bool:
    """Tell whether a law fits the data clearly better than its own special case.

    On folds left out it need not: its further numbers are known less well from less data.
    """
    general, simple = (
        block_losses(f.point.residual[None], search.where)[0] for f in (fit, special)
    )
    behind, error = paired(general, simple)
    return behind < -CLASS_ERRORS * error
