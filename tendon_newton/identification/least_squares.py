"""Levenberg-Marquardt for many small problems at once: their trials are worlds of one launch."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tendon_newton.data.recording import Array, Indices
from tendon_newton.identification.objective import loss_terms, loss_weights
from tendon_newton.identification.study import replacements

Simulate = Callable[[Indices, Array], Array]
"""(columns (N, F), values (N, F)) -> scaled residuals (N, M)."""

DAMPINGS = (0.0, 0.1, 5.0)
"""Marquardt factors that are tried side by side."""
LARGEST_FACTOR = 2.0
"""By which one step changes a number that is never zero: a scale, a speed, a time constant."""
STEP_SHARE = 1.0e-2
"""Finite-difference step as a share of a parameter's value.

Stick and slip make smaller steps noisy.
"""
STEP_FLOOR = 1.0e-4
"""The same as a share of its range, which is added."""


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """A set of parameters to be fitted, and where the search stands."""

    name: str
    """Effect that is tried, or what else tells it apart."""
    columns: tuple[int, ...]
    """Places of its free parameters."""
    lower: Array
    """Bounds, shape (F,)."""
    upper: Array
    """Bounds, shape (F,)."""
    value: Array
    """Where it stands, shape (F,)."""
    loss: float = np.inf
    """Loss there, summed over all rows."""


@dataclass(frozen=True, kw_only=True)
class Linearisation:
    """A candidate's residuals around its optimum."""

    residual: Array
    """Scaled residuals, shape (M,)."""
    jacobian: Array
    """Their derivatives by each parameter, shape (M, F)."""

    def normal_matrix(self, rows: Array | None = None) -> Array:
        """Return the weighted normal matrix over some rows, shape (F, F)."""
        w = loss_weights(self.residual)
        w = w if rows is None else w * rows
        return self.jacobian.T @ (w[:, None] * self.jacobian)

    def gradient(self, rows: Array | None = None) -> Array:
        """Return the gradient of the loss over some rows, shape (F,)."""
        w = loss_weights(self.residual)
        w = w if rows is None else w * rows
        return self.jacobian.T @ (w * self.residual)


def evaluate(simulate: Simulate, candidates: Sequence[Candidate], values: Sequence[Array]) -> Array:
    """Return the scaled residuals of candidates at given values, shape (N, M)."""
    pairs = zip(candidates, values, strict=True)
    return simulate(*replacements([dict(zip(c.columns, v, strict=True)) for c, v in pairs]))


def choose_start(
    simulate: Simulate, candidates: Sequence[Candidate], starts: Sequence[Array]
) -> list[Candidate]:
    """Put each candidate at the best of its starting points, shape (S, F) each."""
    trials = [(c, x) for c, xs in zip(candidates, starts, strict=True) for x in xs]
    losses = loss_terms(evaluate(simulate, [c for c, _ in trials], [x for _, x in trials])).sum(1)
    out, at = [], 0
    for candidate, xs in zip(candidates, starts, strict=True):
        best = at + int(np.argmin(losses[at : at + len(xs)]))
        out.append(replace(candidate, value=trials[best][1], loss=float(losses[best])))
        at += len(xs)
    return out


def linearise(simulate: Simulate, candidates: Sequence[Candidate]) -> list[Linearisation]:
    """Return residuals and Jacobians at the candidates' values, by finite differences."""
    owners, values, steps = [], [], []
    for candidate in candidates:
        owners.append(candidate)
        values.append(candidate.value)
        steps.append(0.0)
        for f in range(len(candidate.columns)):
            step = STEP_SHARE * abs(candidate.value[f])
            step += STEP_FLOOR * (candidate.upper[f] - candidate.lower[f])
            if candidate.value[f] + step > candidate.upper[f]:
                step = -step
            moved = candidate.value.copy()
            moved[f] += step
            owners.append(candidate)
            values.append(moved)
            steps.append(step)
    residuals = evaluate(simulate, owners, values)
    out, at = [], 0
    for candidate in candidates:
        count = len(candidate.columns)
        slopes = [(residuals[at + 1 + f] - residuals[at]) / steps[at + 1 + f] for f in range(count)]
        jacobian = np.stack(slopes, axis=1) if count else np.zeros((residuals.shape[1], 0))
        out.append(Linearisation(residual=residuals[at], jacobian=jacobian))
        at += 1 + count
    return out


def refine(
    simulate: Simulate,
    candidates: Sequence[Candidate],
    iterations: int = 8,
    tolerance: float = 1e-4,
) -> list[Candidate]:
    """Descend from each candidate's value.

    Args:
        simulate: Simulates candidates.
        candidates: Where to start.
        iterations: Steps at most.
        tolerance: A step that lowers the loss by a smaller share [1] is a candidate's last.
    """
    current = list(candidates)
    active = [bool(c.columns) for c in current]
    for _ in range(iterations):
        chosen = [i for i, on in enumerate(active) if on]
        if not chosen:
            break
        points = linearise(simulate, [current[i] for i in chosen])
        trials, values = [], []
        for i, point in zip(chosen, points, strict=True):
            for damping in DAMPINGS:
                trials.append(current[i])
                values.append(damped_step(current[i], point, damping))
        losses = loss_terms(evaluate(simulate, trials, values)).sum(1)
        for place, (i, point) in enumerate(zip(chosen, points, strict=True)):
            before = float(loss_terms(point.residual).sum())
            span = slice(place * len(DAMPINGS), (place + 1) * len(DAMPINGS))
            best = span.start + int(np.argmin(losses[span]))
            active[i] = losses[best] < before * (1.0 - tolerance)
            if losses[best] < before:
                current[i] = replace(current[i], value=values[best], loss=float(losses[best]))
            else:
                current[i] = replace(current[i], loss=before)
    return current


def invertible(hessian: Array) -> Array:
    """Return a normal matrix with a ridge so small that it helps idle parameters only."""
    return hessian + 1.0e-9 * np.diag(np.maximum(np.diag(hessian), 1.0e-30))


def damped_step(candidate: Candidate, point: Linearisation, damping: float) -> Array:
    """Return where one Marquardt step leads, inside the bounds.

    Parameters held by a bound do not move the others.
    """
    hessian, gradient = point.normal_matrix(), point.gradient()
    value = candidate.value
    held = ((value <= candidate.lower) & (gradient > 0)) | (
        (value >= candidate.upper) & (gradient < 0)
    )
    free = ~held
    scale = np.maximum(np.diag(hessian), 1.0e-12 * max(1.0e-30, float(np.max(np.diag(hessian)))))
    matrix = hessian + np.diag((damping + 1.0e-9) * scale + 1.0e-300)
    step = np.zeros_like(value)
    if free.any():
        step[free] = -np.linalg.solve(matrix[np.ix_(free, free)], gradient[free])
    low, high = reach(candidate)
    return np.clip(value + step, low, high)


def reach(candidate: Candidate) -> tuple[Array, Array]:
    """Return how far one step may go: a number that is never zero changes by a factor at most."""
    positive = candidate.lower > 0.0
    low = np.where(positive, candidate.value / LARGEST_FACTOR, candidate.lower)
    high = np.where(positive, candidate.value * LARGEST_FACTOR, candidate.upper)
    return np.maximum(low, candidate.lower), np.minimum(high, candidate.upper)
