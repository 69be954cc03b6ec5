"""Parts of the recordings that a fit does not see, so that its loss there is honest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tendon_newton.data.recording import Array, Indices, Mask
from tendon_newton.identification.least_squares import Candidate, Linearisation, invertible
from tendon_newton.identification.objective import Layout, Scales, block_losses, stack
from tendon_newton.identification.study import Study

FOLDS = 5
"""Folds at most."""
LEAST_RECORDINGS = 3
"""With fewer recordings than this, each is cut into `FOLDS` spans of time."""


@dataclass(frozen=True, kw_only=True)
class Folds:
    """Which fold each entry of a residual vector, and each recording, belongs to."""

    of_entry: Indices
    """Fold of each entry, shape (M,)."""
    of_recording: Indices | None
    """Fold of each recording, shape (R,); None where recordings are cut into spans."""
    count: int


def make_folds(study: Study, where: Layout) -> Folds:
    """Divide a study by recording where it has enough of them, else by spans of blocks."""
    recordings = len(study.recordings)
    if recordings >= LEAST_RECORDINGS:
        count = min(FOLDS, recordings)
        of_recording = np.arange(recordings) % count
        return Folds(of_entry=of_recording[where.recording], of_recording=of_recording, count=count)
    span = np.arange(where.block_count) * FOLDS // max(1, where.block_count)
    return Folds(of_entry=span[where.block], of_recording=None, count=FOLDS)


def value_without(candidate: Candidate, point: Linearisation, left_out: Mask) -> Array:
    """Return where a fit ends that does not see some rows, shape (F,).

    It takes one Gauss-Newton step from the optimum of all.
    """
    if not candidate.columns:
        return candidate.value
    seen = (~left_out).astype(np.float64)
    step = np.linalg.solve(invertible(point.normal_matrix(seen)), point.gradient(seen))
    return np.clip(candidate.value - step, candidate.lower, candidate.upper)


def held_out_losses(
    study: Study,
    scales: Scales,
    where: Layout,
    folds: Folds,
    candidates: Sequence[Candidate],
    points: Sequence[Linearisation],
) -> Array:
    """Return each block of time's loss under the fit that did not see its fold, shape (N, B)."""
    width = max(1, max(len(c.columns) for c in candidates))
    columns = np.full((len(candidates), width), -1, dtype=int)
    values = np.zeros((folds.count, len(candidates), width))
    for n, (candidate, point) in enumerate(zip(candidates, points, strict=True)):
        size = len(candidate.columns)
        columns[n, :size] = candidate.columns
        for fold in range(folds.count):
            values[fold, n, :size] = value_without(candidate, point, folds.of_entry == fold)
    if folds.of_recording is not None:
        by_recording = np.moveaxis(values[folds.of_recording], 0, 1)
        return block_losses(stack(study.residuals(columns, by_recording), scales), where)
    total = np.zeros((len(candidates), where.block_count))
    for fold in range(folds.count):
        scaled = stack(study.residuals(columns, values[fold]), scales)
        total += block_losses(np.where(folds.of_entry == fold, scaled, 0.0), where)
    return total
