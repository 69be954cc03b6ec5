"""May a cause be named? What an extension of the model must gain, on folds that it did not see."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tendon_newton.data.recording import Array
from tendon_newton.diagnosis.adequacy import COUNT, is_noise, residual_sizes
from tendon_newton.diagnosis.detection import gain_p_value
from tendon_newton.diagnosis.greedy import Fit, Round, Search, at_bounds, parameter_count
from tendon_newton.effects import find_effect
from tendon_newton.identification.intervals import intervals
from tendon_newton.identification.least_squares import Candidate
from tendon_newton.identification.noise_floor import NoiseFloor
from tendon_newton.identification.objective import group_sums

P_VALUE = 0.02
"""Chance of a false alarm that a step of the extension may take."""
LEAST_T = 1.7
"""Paired gain over its standard error, from block to block, that a step needs."""
LEAST_SHARE = 0.15
"""Share of the loss above the noise that a cause must remove."""
QUIET_SHARE = 0.65
"""The same where the residual looks like noise already, for form errors must not get names; and
where what is left is small beside the first gap, but more than noise."""
LEAST_ORIGINAL_SHARE = 0.05
"""Share of the starting model's loss above the noise below which nothing is named that does not
close the gap."""
POSITION_SHARE = 0.01
"""The same where only positions are known: no law of dry friction leaves an error of form there."""
POSITION_T = 3.0
"""Paired gain over its standard error that rules out an effect's null where no force is compared,
whatever its interval says."""
STATED_T = 2.1
"""The same once a model's unknown numbers are what it states: by chance it is passed in a share of
`P_VALUE`, and no number that could be anything is left to widen it."""
LEAST_FORCE = 0.01
"""Change of the force [N] that is worth a name on a nominal bench; of the motor angle it is one
count."""
EQUAL_SHARE = 0.01
"""Losses closer than this share of the gain count as equal, however small their standard error."""
SMALL_SHARE = 0.2
"""Losses further apart than this share of the gain differ, however large their standard error."""


@dataclass(frozen=True, kw_only=True)
class Gate:
    """Decides which extensions of a model are findings.

    Args:
        search: Fits of the training recordings.
        known: Effects that the starting model has.
        noise: Noise of the sensors.
        baseline: The starting model with its unknown numbers refitted.
        rng: Of the surrogates.
    """

    search: Search
    known: Sequence[str]
    noise: NoiseFloor
    baseline: Candidate
    rng: np.random.Generator

    def chance(self, tried: Round) -> float:
        """Return the chance of a round's best gain when there is nothing to find."""
        return gain_p_value(self.search, tried.fits, tried.current, self.rng)

    def opens(self, tried: Round, fit: Fit, chance: float) -> bool:
        """Tell whether a fit is a clear, significant gain on unseen folds, in most of the data."""
        current = tried.current
        gap = self.above_noise(tried, current)
        gain, error = paired(current.losses, fit.losses)
        by_part = part_losses(self.search, current.losses - fit.losses)
        if self.is_quiet(current):
            least = max(QUIET_SHARE * gap, self.least_gap(tried))
        elif self.is_quiet(fit) and gain > QUIET_SHARE * gap:
            least = 0.0  # it closes the gap, however small that is beside the first one
        else:
            least = max(LEAST_SHARE * gap, self.least_gap(tried))
        return (
            gap > 0.0
            and chance <= P_VALUE
            and gain > least
            and gain > LEAST_T * error
            and self.is_common(by_part, gain)
            and not at_bound(fit)
            and self.is_material(tried, fit)
            and (
                self.excludes_null(fit)
                or self.is_decisive(gain, error)
                or self.is_decisive_as_stated(tried, fit)
            )
        )

    @property
    def sees_force(self) -> bool:
        """Whether a force is compared as well, and not positions alone."""
        return bool(self.search.where.is_force.any())

    def is_common(self, by_part: Array, gain: float) -> bool:
        """Tell whether most of the data gains, or at least loses next to nothing.

        Positions alone show some causes only where they are told to move fast, and are the same
        without them elsewhere.
        """
        least = 0.0 if self.sees_force else -EQUAL_SHARE * gain
        return float(np.mean(by_part > least)) > 0.5

    def is_quiet(self, fit: Fit) -> bool:
        """Tell whether a fit leaves no more than noise and the form errors of its effects."""
        return is_noise(self.search, fit, self.noise, self.known)

    def is_material(self, tried: Round, fit: Fit) -> bool:
        """Tell whether a fit changes what is simulated by more than nobody would miss."""
        before, after = (residual_sizes(self.search, f) for f in (tried.current, fit))
        theta = before.theta**2 - after.theta**2
        force = (before.force or 0.0) ** 2 - (after.force or 0.0) ** 2
        scale = self.search.study.scale
        return theta > (COUNT * scale.turn) ** 2 or force > (LEAST_FORCE * scale.force) ** 2

    def excludes_null(self, fit: Fit) -> bool:
        """Tell whether a strength of a fit's last effect is known to differ from none."""
        effect = find_effect(fit.effects[-1])
        strengths = effect.dry or (effect.parameters[0].name,)
        own = intervals(fit.candidate, fit.point, self.search.where)[-len(effect.parameters) :]
        return any(
            parameter.name in strengths and not low <= parameter.null <= high
            for parameter, (low, high) in zip(effect.parameters, own, strict=True)
        )

    def is_decisive(self, gain: float, error: float) -> bool:
        """Tell whether a paired gain rules out an effect's null where no force is compared.

        In closed loop from positions alone a few seconds, such as those at full duty, carry most of
        what is known of a number. An interval to first order, drawn from blocks of time, then
        reaches beyond null although all other blocks are far worse off without the effect.
        """
        return not self.sees_force and gain > POSITION_T * error

    def is_decisive_as_stated(self, tried: Round, fit: Fit) -> bool:
        """Tell whether null is ruled out once a model's unknown numbers are what it states.

        From positions alone such numbers stand for much that is missing: a resistance that is too
        high for torque that fades, as far as the recordings reach. An interval then holds null
        although what a data sheet says of them rules it out. Only this last question is put to the
        stated numbers: all gains are those of fits in which they were free.
        """
        search = self.search.as_stated()
        if self.sees_force or search.fit_columns == self.search.fit_columns:
            return False
        pair = [tried.current, fit]
        held = [search.problem(f.effects, f.candidate)[0] for f in pair]
        newest = [0, parameter_count(fit.effects[-1:])]
        found, scales = search.descend(held, newest, tried.scales)
        without, own = search.score([f.effects for f in pair], found, scales)
        gain, error = paired(without.losses, own.losses)
        return gain > STATED_T * error

    def is_exhausted(self, tried: Round, fit: Fit) -> bool:
        """Tell whether a fit leaves so little of the first gap that only what closes it counts."""
        return self.above_noise(tried, fit) < self.least_gap(tried)

    def least_gap(self, tried: Round) -> float:
        """Return the loss above the noise that is worth explaining, at a round's scales."""
        share = POSITION_SHARE if self.search.study.kinematic else LEAST_ORIGINAL_SHARE
        start = tried.current
        if start.effects:
            start = self.search.score([()], [self.baseline], tried.scales)[0]
        return share * self.above_noise(tried, start)

    def above_noise(self, tried: Round, fit: Fit) -> float:
        """Return the loss that a fit leaves above that of sensor noise alone."""
        return fit.loss - noise_loss(self.search, tried, self.noise)


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
        close = is_close(fit, best, gain, 1.0)
        if close and parameter_count(fit.effects) < parameter_count(choice.effects):
            choice = fit
    return choice


def is_close(fit: Fit, best: Fit, gain: float, errors: float) -> bool:
    """Tell whether a fit explains as much as another of a given gain.

    Args:
        fit: It.
        best: The other.
        gain: What the other removes.
        errors: Standard errors of the difference that count as none.
    """
    behind, error = paired(fit.losses, best.losses)
    return behind <= max(min(errors * error, SMALL_SHARE * gain), EQUAL_SHARE * gain)


def paired(worse: Array, better: Array) -> tuple[float, float]:
    """Return the summed difference of block losses and its standard error."""
    difference = worse - better
    return float(difference.sum()), float(difference.std(ddof=1) * np.sqrt(len(difference)))


def noise_loss(search: Search, tried: Round, noise: NoiseFloor) -> float:
    """Return the loss that sensor noise alone leaves, at a round's scales."""
    forces = int(np.sum(search.where.is_force))
    angles = len(search.where.is_force) - forces
    theta = angles * (noise.theta / tried.scales.theta) ** 2
    force = forces * ((noise.force or 0.0) / tried.scales.force) ** 2
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
    return bool(at_bounds(fit.candidate, fit.effects[-1]))
