"""What a cause is worth on recordings that no number has seen, by real refits."""

import time
from collections.abc import Sequence

import numpy as np
from scipy.linalg import eigh

from tendon_newton.data.recording import Array, Indices, Mask, Recording
from tendon_newton.diagnosis.search.refit import Fit, linearise, refit, rows_of
from tendon_newton.diagnosis.search.search_worlds import Floors, SearchWorlds
from tendon_newton.identification.objective import TAIL, loss_weights

FOLDS = 5  # Parts that are left out in turn, at most
LEAST_PARTS = 3  # Recordings from which whole ones are left out; fewer are cut in time
PART = 4
"""Length of the spans of time [blocks] that are left out where recordings are few: every fifth."""
TOLD = 0.5  # Share of what all rows tell of a direction that the seen ones must tell [1]
RIDGE, HOLD = 1.0e-9, 1.0e3
"""Least curvature of a direction, and what holds one, as shares of what all rows tell [1]."""
STEPS = 2
"""Steps of a refit from the optimum of all rows, with the derivatives there: it moves little."""


def folds(worlds: SearchWorlds) -> Indices:
    """Return the part that each row belongs to, shape (M,).

    Conditions are left out whole where there are several, else recordings. What is all of its
    bench, and few recordings, are cut in time: nobody can know numbers of a bench that nobody saw.
    """
    groups = groups_of(worlds.study.wholes)
    bench = {g: r.bench for g, r in zip(groups, worlds.study.wholes, strict=True)}
    turn = {g: i for i, g in enumerate(sorted(bench, key=lambda g: bench[g]))}
    owns_bench = [list(bench.values()).count(bench[g]) == 1 for g in groups]
    whole = np.array([turn[g] for g in groups])[worlds.where.recording]
    in_time = np.array(owns_bench)[worlds.where.recording] | (len(groups) < LEAST_PARTS)
    return np.where(in_time, worlds.where.block // PART, whole) % FOLDS


def groups_of(recordings: Sequence[Recording]) -> list[int]:
    """Return for each recording the number of the condition, or of the recording, that it is.

    Recordings that share a bench's and an actuator's own numbers are one condition.
    """
    keys = [repr((r.bench, r.bench_overrides, dict(r.actuator_overrides))) for r in recordings]
    own = [bool(r.actuator_overrides) or repr(r.bench_overrides) != repr(type(r.bench_overrides)())
           for r in recordings]  # fmt: skip
    different = list(dict.fromkeys(keys))
    if all(own) and len(different) > 1:
        return [different.index(key) for key in keys]
    return list(range(len(recordings)))


def unseen_terms(
    worlds: SearchWorlds, fit: Fit, floors: Floors, until: float = np.inf
) -> Array | None:
    """Return each row's share of the score under refits that did not see its part, shape (M,).

    A row's signal counts alike however many rows it has, as in `SearchWorlds.score`; the sum over
    rows is the score.

    Args:
        worlds: Simulates candidates.
        fit: A set at its optimum of all rows.
        floors: Least scale of each signal.
        until: Instant of the monotonic clock [s] from which no part is left out any more.

    Returns:
        The shares; None where the time did not suffice.
    """
    of_row, jacobians = folds(worlds), linearise(worlds, [fit])
    total = np.zeros(len(of_row))
    for fold in np.unique(of_row):
        if time.monotonic() > until:
            return None
        seen = of_row != fold
        unit = rows_of(worlds, fit, floors).size
        hold = untold(fit, jacobians[0] / unit[:, None], unit, seen)
        (found,) = refit(
            worlds, [fit], floors, iterations=STEPS, coarse=0, rows=seen,
            jacobians=jacobians, holds=[hold],
        )  # fmt: skip
        residual = found.residual[None]
        score = worlds.score(residual, floors, rows=seen)
        (own,) = terms(worlds, residual, score.scales, floors)
        total += np.where(seen, 0.0, own)
    return total


def untold(fit: Fit, slopes: Array, unit: Array, seen: Mask) -> Array:
    """Return a curvature that holds directions of which the seen rows tell little, shape (F, F).

    Nobody can know of a number what nobody saw. A direction stays where it is if the rows that
    are left out have more than a share of all that is known of it.

    Args:
        fit: A set at its optimum of all rows.
        slopes: Derivatives of the residual [units], shape (M, F).
        unit: Unit of each row's residual, shape (M,).
        seen: Rows that a refit sees, shape (M,).
    """
    weighted = slopes * np.sqrt(loss_weights(fit.residual / unit))[:, None]
    size = np.sqrt(np.maximum(np.square(weighted).sum(axis=0), 1.0e-300))
    all_rows = weighted.T @ weighted / np.outer(size, size) + RIDGE * np.eye(len(size))
    some = weighted[seen].T @ weighted[seen] / np.outer(size, size) + RIDGE * np.eye(len(size))
    shares, directions = eigh(some, all_rows)
    kept = all_rows @ directions[:, shares < TOLD]
    return HOLD * (kept @ kept.T) * np.outer(size, size)


def terms(worlds: SearchWorlds, residuals: Array, scales: Array, floors: Floors) -> Array:
    """Return each row's share of the score at given scales of the signals, shape (N, M)."""
    weight, out = worlds.weights(floors), np.zeros_like(residuals)
    for (signal, rows), own in zip(worlds.where.signals, scales.T, strict=True):
        floor = floors.of(signal)
        scale = np.maximum(own, floor)[:, None]
        tail = 0.5 * TAIL**2 * np.log1p((residuals[:, rows] / scale / TAIL) ** 2)
        share = weight[rows] / weight[rows].sum()
        out[:, rows] = (np.log(scale / floor) + tail) * share
    return out
