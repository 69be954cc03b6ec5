"""From residuals to one number: robust loss in units of what may be left over, by row and by block of time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tendon_newton.identification.study import Residual, Study
from tendon_newton.recording import Array

TAIL = 3.0
"""Residuals beyond this many scales count logarithmically: rows of a jump must not decide."""
BLOCK = 1.0
"""Length [s] of the blocks whose losses are compared; the mechanisms forget faster."""


@dataclass(frozen=True, kw_only=True)
class Scales:
    """What counts as one unit of residual."""

    theta: float
    """[rad]"""
    force: float
    """[N]"""


@dataclass(frozen=True, kw_only=True)
class Layout:
    """Where each entry of a residual vector comes from, shape (M,) each."""

    recording: Array
    """Index of the recording."""
    block: Array
    """Index of the block of time, counted through all recordings."""
    is_force: Array
    """Whether the entry is a force (or else an angle)."""
    block_count: int
    """Number of blocks B."""


def stack(residuals: Sequence[Residual], scales: Scales) -> Array:
    """Return residuals in units of their scales, untrusted rows left out, shape (N, M)."""
    parts = []
    for residual in residuals:
        parts.append(residual.theta[:, residual.trusted] / scales.theta)
        if residual.force is not None:
            parts.append(residual.force[:, residual.trusted] / scales.force)
    return np.concatenate(parts, axis=1)


def layout(study: Study) -> Layout:
    """Describe the vectors that `stack` makes of a study's residuals."""
    recording, block, is_force = [], [], []
    count = 0
    for index, source in enumerate(study.recordings):
        trusted = study.timeline(index).trusted
        place = ((source.time - source.time[0]) / BLOCK).astype(int)
        for force in (False, True) if source.force is not None else (False,):
            recording.append(np.full(int(trusted.sum()), index))
            block.append(count + place[trusted])
            is_force.append(np.full(int(trusted.sum()), force))
        count += int(place[-1]) + 1
    return Layout(
        recording=np.concatenate(recording),
        block=np.concatenate(block),
        is_force=np.concatenate(is_force),
        block_count=count,
    )


def loss_terms(scaled: Array) -> Array:
    """Return the loss of each entry: r^2 / 2 for small residuals, logarithmic beyond `TAIL` scales."""
    return 0.5 * TAIL**2 * np.log1p((scaled / TAIL) ** 2)


def loss_weights(scaled: Array) -> Array:
    """Return the weights under which least squares has the gradient of the loss."""
    return 1.0 / (1.0 + (scaled / TAIL) ** 2)


def block_losses(scaled: Array, where: Layout) -> Array:
    """Return the summed loss of each block of time, shape (N, B)."""
    terms = loss_terms(scaled)
    return np.stack([np.bincount(where.block, row, minlength=where.block_count) for row in terms])


def robust_scale(residuals: Sequence[Residual]) -> tuple[Array, Array]:
    """Return the robust size of the angle [rad] and force [N] residuals of each candidate, shapes (N,)."""
    theta = np.concatenate([r.theta[:, r.trusted] for r in residuals], axis=1)
    forces = [r.force[:, r.trusted] for r in residuals if r.force is not None]
    size = lambda x: 1.4826 * np.median(np.abs(x), axis=1)  # noqa: E731
    force = size(np.concatenate(forces, axis=1)) if forces else np.zeros(len(theta))
    return size(theta), force
