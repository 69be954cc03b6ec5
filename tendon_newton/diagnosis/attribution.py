"""Which causes? Greedy extension, each step gated on unseen folds, then pruning and classes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tendon_newton.diagnosis.adequacy import is_noise
from tendon_newton.diagnosis.detection import gain_p_value
from tendon_newton.diagnosis.search import Fit, Round, Search, parameter_count
from tendon_newton.effects import find_effect
from tendon_newton.identification.least_squares import Candidate
from tendon_newton.identification.noise_floor import NoiseFloor
from tendon_newton.identification.objective import Scales, block_losses, group_sums
from tendon_newton.recording import Array

MOST_CAUSES = 3
"""Causes that are looked for at once."""
P_VALUE = 0.02
"""Chance of a false alarm that a step of the extension may take."""
LEAST_T = 1.7
"""Paired gain over its standard error, from block to block, that a step needs."""
LEAST_SHARE = 0.15
"""Share of the loss above the noise that a cause must remove."""
QUIET_SHARE = 0.65
"""The same where the residual looks like noise already: form errors must not get names."""
LEAST_ORIGINAL_SHARE = 0.05
"""Share of the starting model's loss above the noise below which nothing is sought or named."""
POSITION_SHARE = 0.01
"""The same where only positions are known: no law of dry friction leaves an error of form there."""
EQUAL_SHARE = 0.01
"""Losses closer than this share of the gain count as equal, however small their standard error."""
SMALL_SHARE = 0.2
"""Losses further apart than this share of the gain differ, however large their standard error."""
CLASS_ERRORS = 2.0
"""Candidates within so many paired standard errors of the best are not told from it."""
LARGEST_CLASS = 3
"""A class counts as an answer with at most so many names."""


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
    original = POSITION_SHARE if search.study.kinematic else LEAST_ORIGINAL_SHARE
    baseline = search.baseline()
    current, chosen = baseline, ()
    rounds: list[Round] = []
    p_value = 1.0
    final = None
    for step in range(MOST_CAUSES):
        tried = search.extend(current, chosen, [n for n in names if n not in chosen])
        best = simplest(tried)
        rounds.append(tried)
        chance = gain_p_value(search, tried.fits, tried.current, rng)
        p_value = chance if step == 0 else p_value
        start = tried.current if step == 0 else search.score([()], [baseline], tried.scales)[0]
        gap = above_noise(search, tried, tried.current, noise)
        least = max(
            least_share(search, tried, known, noise) * gap,
            original * above_noise(search, tried, start, noise),
        )
        if gap <= 0.0 or chance > P_VALUE or not passes(search, tried, best, least):
            break
        final = best
        current, chosen = best.candidate, best.effects
        left = above_noise(search, tried, best, noise)
        if left < original * above_noise(search, tried, start, noise):
            break
    classes: dict[str, tuple[Fit, ...]] = {}
    if final is not None:
        final, classes = examine(search, final, names, rounds[0], noise)
    return Attribution(
        rounds=tuple(rounds), baseline=baseline, final=final, classes=classes, p_value=p_value
    )


def simplest(tried: Round) -> Fit:
    """Return the simplest candidate that is within one standard error of the best.

    A number at the edge of its range stands for something that the range rules out: such
    candidates come last.
    """
    inside = [fit for fit in tried.fits if not at_bound(fit)] or list(tried.fits)
    best = inside[0]
    gain = tried.current.loss - best.loss
    choice = best
    for fit in inside[1:]:
        behind, error = paired(fit.losses, best.losses)
        close = behind <= max(min(error, SMALL_SHARE * gain), EQUAL_SHARE * gain)
        if close and parameter_count(fit.effects) < parameter_count(choice.effects):
            choice = fit
    return choice


def passes(search: Search, tried: Round, fit: Fit, least_gain: float) -> bool:
    """Gate a step: a clear, significant gain on unseen folds, in most of the data."""
    gain, error = paired(tried.current.losses, fit.losses)
    by_part = part_losses(search, tried.current.losses - fit.losses)
    return (
        gain > least_gain
        and gain > LEAST_T * error
        and float(np.mean(by_part > 0.0)) > 0.5
        and not at_bound(fit)
    )


def least_share(search: Search, tried: Round, known: Sequence[str], noise: NoiseFloor) -> float:
    """Return the share of what is above the noise that a cause must remove in a round."""
    effects = [*known, *tried.current.effects]
    quiet = is_noise(search, tried.current.point, tried.scales, noise, effects)
    return QUIET_SHARE if quiet else LEAST_SHARE


def above_noise(search: Search, tried: Round, fit: Fit, noise: NoiseFloor) -> float:
    """Return the loss that a fit leaves above that of sensor noise alone."""
    return fit.loss - noise_loss(search, tried.scales, noise)


def paired(worse: Array, better: Array) -> tuple[float, float]:
    """Return the summed difference of block losses and its standard error."""
    difference = worse - better
    return float(difference.sum()), float(difference.std(ddof=1) * np.sqrt(len(difference)))


def noise_loss(search: Search, scales: Scales, noise: NoiseFloor) -> float:
    """Return the loss that sensor noise alone leaves."""
    forces = int(np.sum(search.where.is_force))
    angles = len(search.where.is_force) - forces
    theta = angles * (noise.theta / scales.theta) ** 2
    force = forces * ((noise.force or 0.0) / scales.force) ** 2
    return 0.5 * (theta + force)


def part_losses(search: Search, losses: Array) -> Array:
    """Sum losses of blocks by recording, or by fold where those are few, shape (R,) or (K,)."""
    folds = search.folds
    parts = search.where.recording if folds.of_recording is not None else folds.of_entry
    owner = np.zeros(search.where.block_count, dtype=np.intp)
    owner[search.where.block] = parts
    return group_sums(losses, owner)


def at_bound(fit: Fit) -> bool:
    """Tell whether the last effect of a fit ended at a parameter's bound other than its null."""
    count = parameter_count(fit.effects[-1:])
    parameters = find_effect(fit.effects[-1]).parameters
    c = fit.candidate
    rows = zip(parameters, c.value[-count:], c.lower[-count:], c.upper[-count:], strict=True)
    return any(value in (low, high) and value != p.null for p, value, low, high in rows)


def others_of(search: Search, final: Fit, effect: str) -> tuple[tuple[str, ...], Candidate]:
    """Return the other effects of a fit, and a candidate with their parameters alone."""
    others = tuple(name for name in final.effects if name != effect)
    candidate, _ = search.problem(others, final.candidate)
    return others, candidate


def examine(
    search: Search, final: Fit, names: Sequence[str], alone: Round, noise: NoiseFloor
) -> tuple[Fit, dict[str, tuple[Fit, ...]]]:
    """Drop causes that later ones made redundant; find for the others what could replace them.

    Args:
        search: Fits of the training recordings.
        final: All causes together.
        names: Effects that may be named.
        alone: The round in which every effect was tried by itself.
        noise: Noise of the sensors.
    """
    if len(final.effects) == 1:
        return final, {final.effects[0]: indistinguishable(search, alone, final.effects[0])}
    classes = {}
    for effect in final.effects:
        others, candidate = others_of(search, final, effect)
        rivals = [name for name in names if name not in others]
        tried = search.extend(candidate, others, rivals)
        if redundant(search, tried, effect, noise):
            return examine(search, tried.current, names, alone, noise)
        if (simpler := special_case(tried, effect)) is not None:
            return examine(search, simpler, names, alone, noise)
        classes[effect] = indistinguishable(search, tried, effect)
    return final, classes


def special_case(tried: Round, effect: str) -> Fit | None:
    """Return the fit with a special case of an effect in its place that explains as much."""
    own = next((fit for fit in tried.fits if fit.effects[-1] == effect), None)
    for fit in tried.fits:
        if own is not None and fit.effects[-1] in find_effect(effect).includes:
            gain = tried.current.loss - own.loss
            behind, error = paired(fit.losses, own.losses)
            if behind <= max(min(error, SMALL_SHARE * gain), EQUAL_SHARE * gain):
                return fit
    return None


def redundant(search: Search, tried: Round, effect: str, noise: NoiseFloor) -> bool:
    """Tell whether the others explain the data as well without a cause."""
    own = [fit for fit in tried.fits if fit.effects[-1] == effect]
    gain, error = paired(tried.current.losses, (own or tried.fits)[0].losses)
    least = LEAST_SHARE * above_noise(search, tried, tried.current, noise)
    return gain < max(LEAST_T * error, least)


def indistinguishable(search: Search, tried: Round, effect: str) -> tuple[Fit, ...]:
    """Return the rivals of one effect that the data cannot tell from it, nearest first."""
    own = next((fit for fit in tried.fits if fit.effects[-1] == effect), None)
    if own is None:
        return ()
    gain = tried.current.loss - own.loss
    rivals = []
    for fit in tried.fits:
        behind, error = paired(fit.losses, own.losses)
        close = behind <= max(min(CLASS_ERRORS * error, SMALL_SHARE * gain), EQUAL_SHARE * gain)
        contains = effect in find_effect(fit.effects[-1]).includes
        if fit is not own and close and (not contains or fits_better(search, fit, own)):
            rivals.append((behind, fit))
    nearest = sorted(rivals, key=lambda rival: rival[0])
    return tuple(fit for _, fit in nearest)[: LARGEST_CLASS - 1]


def fits_better(search: Search, fit: Fit, special: Fit) -> bool:
    """Tell whether a law fits the data clearly better than its own special case.

    On folds left out it need not: its further numbers are known less well from less data.
    """
    general, simple = (
        block_losses(f.point.residual[None], search.where)[0] for f in (fit, special)
    )
    behind, error = paired(general, simple)
    return behind < -CLASS_ERRORS * error
