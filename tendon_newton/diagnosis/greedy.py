"""Joint refits of candidate causes, from the gap's scale down to what may remain, and scores."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass

import numpy as np

from tendon_newton.data.model_file import Model
from tendon_newton.data.parameters import BenchScale
from tendon_newton.data.recording import Array, Indices
from tendon_newton.diagnosis.starts import MOST_STARTS, spread, starting_grid, starts_around
from tendon_newton.effects import find_effect
from tendon_newton.identification.folds import held_out_losses, make_folds
from tendon_newton.identification.least_squares import (
    Candidate,
    Linearisation,
    Simulate,
    choose_start,
    evaluate,
    linearise,
    refine,
)
from tendon_newton.identification.objective import Scales, layout, loss_terms, stack
from tendon_newton.identification.study import Study

FORM_THETA = 3.0e-3
"""Angle [rad] by which Coulomb's law misses real friction (bristles of 5 to 40 um).

A model that is right in all else leaves as much.
"""
FORM_FORCE = 0.1
"""The same of the force [N]. Both are those of the nominal benches; see `form_scales`."""
TYPICAL_SHARE = 0.9
"""Share of the residuals whose size is the size of a gap; a few jumps must not inflate it."""
LONGLIST = 12
"""Candidates that are fitted at the scale of the gap, after one step from their best start."""
SHORTLIST = 6
"""Candidates that are followed down to the finest scale."""
PROMISE = 0.4
"""Share of the best candidate's gain at the scale of the gap that another needs to be followed."""
CLOSED = 0.3
"""Share of a gap that may be left at its own scale by what will close it."""
ROUGH_STEP = 1.0e-3
"""Simulation step [s] until the finest scale; at 2 ms the stops leave errors that hide a bias."""
DESCENT = ((3, ROUGH_STEP, 1.0e-3), (3, ROUGH_STEP, 1.0e-3), (5, None, 1.0e-4))
"""Iterations, simulation step [s] and tolerance [1] on the way down to the finest scale; the last
step is the study's own."""


@dataclass(frozen=True, kw_only=True)
class Fit:
    """A set of effects at its optimum."""

    effects: tuple[str, ...]
    """Effects whose parameters are free, the one tried last at the end; empty for the baseline."""
    candidate: Candidate
    point: Linearisation
    scales: Scales
    """Units of its residuals."""
    losses: Array
    """Loss of each block of time under fits that did not see it, shape (B,)."""

    @property
    def loss(self) -> float:
        """Loss on held-out folds, summed over blocks."""
        return float(self.losses.sum())


@dataclass(frozen=True, kw_only=True)
class Survey:
    """Candidates at the scale of the gap, with simulations as rough as that allows."""

    chosen: tuple[str, ...]
    """What the candidates extend."""
    current: Candidate
    """The same, fitted."""
    loss: float
    """Its loss."""
    sets: tuple[tuple[str, ...], ...]
    """Effects of each candidate, the one tried last at the end."""
    candidates: tuple[Candidate, ...]
    """Each with its loss."""
    scales: Scales

    @property
    def closes(self) -> bool:
        """Whether any candidate leaves so little that its gap may be closed."""
        return min(c.loss for c in self.candidates) < CLOSED * self.loss


@dataclass(frozen=True, kw_only=True)
class Round:
    """One round of candidates, all seen at the same scales."""

    scales: Scales
    current: Fit
    """What the candidates are compared with."""
    fits: tuple[Fit, ...]
    """Candidates that were followed to the finest scale, best first."""
    coarse: dict[str, float]
    """Loss of every candidate at the coarse scale, by its last effect."""
    coarse_current: float
    """Loss of what they extend at that scale."""
    ended: dict[str, dict[str, float]]
    """Numbers of each candidate's last effect that ended at a bound, with that bound."""


class Search:
    """Fits of one study's model with some effects more.

    Args:
        study: Training recordings, with kernels that hold the whole catalogue.
        model: The model to start from.
    """

    def __init__(self, study: Study, model: Model) -> None:
        self.study = study
        self.where = layout(study)
        self.folds = make_folds(study, self.where)
        self.fit_columns = study.fit_columns(model)

    def as_stated(self) -> Search:
        """Return a search that leaves the model's unknown numbers as it states them."""
        other = copy(self)
        other.fit_columns = ()
        return other

    def baseline(self) -> Candidate:
        """Fit the model's own unknown numbers and nothing else."""
        candidate, starts = self.problem((), None)
        candidate = choose_start(self.simulate_at(UNIT), [candidate], [starts])[0]
        for _ in range(2):
            simulate = self.simulate_at(self.gap_scales(candidate))
            candidate = refine(simulate, [candidate], iterations=6)[0]
        return candidate

    def extend(self, current: Candidate, chosen: tuple[str, ...], names: Sequence[str]) -> Round:
        """Try each of some effects on top of those already chosen, everything refitted jointly."""
        return self.follow(self.survey(current, chosen, names))

    def survey(self, current: Candidate, chosen: tuple[str, ...], names: Sequence[str]) -> Survey:
        """Fit each of some effects on top of those already chosen at the scale of the gap."""
        sets = [(*(n for n in chosen if n != name), name) for name in names]
        rough = self.simulate_at(self.gap_scales(current), ROUGH_STEP)
        current = refine(rough, [current], iterations=3)[0]  # without what was taken from it
        problems = [self.problem(effects, current) for effects in sets]
        scales = self.gap_scales(current)
        rough = self.simulate_at(scales, ROUGH_STEP)
        before = float(loss_terms(evaluate(rough, [current], [current.value])).sum())
        found = choose_start(rough, [p[0] for p in problems], [p[1] for p in problems])
        found = refine(rough, found, iterations=1)  # a start may be no better than none at all
        longlist = np.argsort([c.loss for c in found])[:LONGLIST]
        for i, candidate in zip(
            longlist, refine(rough, [found[i] for i in longlist], iterations=2), strict=True
        ):
            found[i] = candidate
        return Survey(
            chosen=chosen,
            current=current,
            loss=before,
            sets=tuple(sets),
            candidates=tuple(found),
            scales=scales,
        )

    def follow(self, survey: Survey) -> Round:
        """Follow the candidates that promise most down to the finest scale."""
        sets, found = survey.sets, survey.candidates
        order = promising(found, survey.loss)
        finalists, fine = self.descend(
            [survey.current, *(found[i] for i in order)],
            [0, *(parameter_count(sets[i][-1:]) for i in order)],
            survey.scales,
        )
        fits = self.score([survey.chosen, *(sets[i] for i in order)], finalists, fine)
        return Round(
            scales=fine,
            current=fits[0],
            fits=tuple(sorted(fits[1:], key=lambda fit: fit.loss)),
            coarse_current=survey.loss,
            coarse={s[-1]: c.loss for s, c in zip(sets, found, strict=True)},
            ended={s[-1]: at_bounds(c, s[-1]) for s, c in zip(sets, found, strict=True)}
            | {fit.effects[-1]: at_bounds(fit.candidate, fit.effects[-1]) for fit in fits[1:]},
        )

    def descend(
        self, candidates: Sequence[Candidate], newest: Sequence[int], scales: Scales
    ) -> tuple[list[Candidate], Scales]:
        """Refit candidates at ever finer scales, down to what the best of them leaves.

        Args:
            candidates: Where the fits start.
            newest: How many of each candidate's last numbers are new, and so may lie in a wrong
                valley; the others were searched before.
            scales: Those of the gap.
        """
        found = list(candidates)
        for step, (iterations, time_step, tolerance) in enumerate(DESCENT):
            best = min(found, key=lambda c: c.loss)
            target = self.gap_scales(best)
            scales = between(scales, target) if step == 0 else target
            simulate = self.simulate_at(scales, time_step)
            starts = [starts_around(c, n) for c, n in zip(found, newest, strict=True)]
            found = choose_start(simulate, found, starts)
            found = refine(simulate, found, iterations=iterations, tolerance=tolerance)
        return found, scales

    def score(
        self, sets: Sequence[tuple[str, ...]], found: Sequence[Candidate], scales: Scales
    ) -> list[Fit]:
        """Evaluate fitted candidates on folds left out of their fit."""
        points = linearise(self.simulate_at(scales), found)
        losses = held_out_losses(self.study, scales, self.where, self.folds, found, points)
        return [
            Fit(effects=effects, candidate=candidate, point=point, scales=scales, losses=loss)
            for effects, candidate, point, loss in zip(sets, found, points, losses, strict=True)
        ]

    def simulate_at(self, scales: Scales, time_step: float | None = None) -> Simulate:
        """Return the function from candidate values to residuals in units of some scales."""
        return lambda columns, values: stack(
            self.study.residuals(columns, values, time_step), scales
        )

    def gap_scales(self, candidate: Candidate) -> Scales:
        """Return the size of a candidate's residuals, at least what the right model leaves."""
        unit = evaluate(self.simulate_at(UNIT), [candidate], [candidate.value])[0]
        force = unit[self.where.is_force]
        form = form_scales(self.study.scale)
        return Scales(
            theta=max(form.theta, trimmed_size(unit[~self.where.is_force], TYPICAL_SHARE)),
            force=max(form.force, trimmed_size(force, TYPICAL_SHARE) if len(force) else 0.0),
        )

    def problem(self, names: tuple[str, ...], current: Candidate | None) -> tuple[Candidate, Array]:
        """Return a candidate with its starting points, shape (S, F)."""
        known = {} if current is None else dict(zip(current.columns, current.value, strict=True))
        own = [c for name in names for c in self.study.table.columns(name)]
        columns = (*self.fit_columns, *own)
        parameters = [self.study.parameter(c) for c in columns]
        values = [
            float(np.clip(known.get(c, self.study.base_value(c)), p.lower, p.upper))
            for c, p in zip(columns, parameters, strict=True)
        ]
        grids = [
            [value] if c in known or c in self.fit_columns else starting_grid(p, value)
            for c, p, value in zip(columns, parameters, values, strict=True)
        ]
        starts = [values, *spread(list(itertools.product(*grids)), MOST_STARTS)]
        candidate = Candidate(
            name="+".join(names) or "baseline",
            columns=columns,
            lower=np.array([p.lower for p in parameters]),
            upper=np.array([p.upper for p in parameters]),
            value=np.array(values),
        )
        return candidate, np.array(starts)


UNIT = Scales(theta=1.0, force=1.0)
"""Residuals in their own units."""


def form_scales(scale: BenchScale) -> Scales:
    """Return by how much simple laws miss on benches of some size.

    Bristles are as long on a long rail as on a short one, so the angle follows the spool alone.
    """
    return Scales(theta=FORM_THETA * scale.turn, force=FORM_FORCE * scale.force)


def between(coarse: Scales, fine: Scales) -> Scales:
    """Return scales half way, by ratio, between two."""
    return Scales(
        theta=float(np.sqrt(coarse.theta * fine.theta)),
        force=float(np.sqrt(coarse.force * fine.force)),
    )


def trimmed_size(residual: Array, share: float) -> float:
    """Return the root mean square of the smaller residuals, which are that share [1] of all."""
    ordered = np.sort(np.abs(residual))[: max(1, int(share * len(residual)))]
    return float(np.sqrt(np.mean(ordered**2)))


def promising(candidates: Sequence[Candidate], before: float) -> Indices:
    """Return the places of the candidates worth following, best first, given what they extend.

    One at a bound gets no name, so it must not set the others' bar.
    """
    gains = before - np.array([c.loss for c in candidates])
    inside = [gain for gain, c in zip(gains, candidates, strict=True) if not held(c)]
    bar = max(inside, default=gains.max())
    order = np.argsort(-gains)[:SHORTLIST]
    return order[gains[order] >= min(bar, PROMISE * bar)]


def held(candidate: Candidate) -> bool:
    """Tell whether any number of a candidate ended at its bound."""
    at = (candidate.value == candidate.lower) | (candidate.value == candidate.upper)
    return bool(at.any())


def at_bounds(candidate: Candidate, effect: str) -> dict[str, float]:
    """Return those numbers of a candidate's last effect that ended at a bound but its null."""
    parameters = find_effect(effect).parameters
    ends = zip(candidate.value, candidate.lower, candidate.upper, strict=True)
    own = list(ends)[-len(parameters) :]
    return {
        p.name: float(value)
        for p, (value, low, high) in zip(parameters, own, strict=True)
        if value in (low, high) and value != p.null
    }


def parameter_count(effects: Sequence[str]) -> int:
    """Return how many numbers a set of effects has."""
    return sum(len(find_effect(name).parameters) for name in effects)


def values_of(candidate: Candidate) -> dict[int, float]:
    """Return parameter column -> value."""
    return {c: float(v) for c, v in zip(candidate.columns, candidate.value, strict=True)}
