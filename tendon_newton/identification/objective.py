"""The robust loss of residuals, in units of what may be left over, by row and by block of time."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from tendon_newton.data.recording import Array, Indices, Mask
from tendon_newton.identification.study import Residual, Study, compares_force

TAIL = 3.0
"""Residuals beyond this many scales count logarithmically: rows of a jump must not decide."""
BLOCK = 1.0  # Length [s] of the blocks whose losses are compared; the mechanisms forget faster


@dataclass(frozen=True, kw_only=True)
class Scales:
    """What counts as one unit of residual."""

    theta: float  # [rad]
    force: float  # [N]


@dataclass(frozen=True, kw_only=True)
class Layout:
    """Where each entry of a residual vector comes from, shape (M,) each."""

    recording: Indices  # Index of the whole recording
    block: Indices  # Index of the block of time, counted through all recordings
    is_force: Mask  # Whether the entry is a force (or else an angle)
    servo: Indices  # Number of its servo
    block_count: int  # Number of blocks B

    @cached_property
    def signals(self) -> tuple[tuple[bool, Mask], ...]:
        """Angle and force of each servo: whether it is a force, and its entries, shape (M,)."""
        servos = range(int(self.servo.max(initial=0)) + 1)
        return tuple(
            (force, (self.is_force == force) & (self.servo == servo))
            for servo in servos
            for force in (False, True)
        )


def stack(residuals: Sequence[Residual], scales: Scales) -> Array:
    """Return residuals in units of their scales, untrusted rows left out, shape (N, M)."""
    parts = []
    for residual in residuals:
        parts.append((residual.theta, residual.trusted, scales.theta))
        if residual.force is not None:
            parts.append((residual.force, residual.trusted, scales.force))
    ends = np.cumsum([trusted.sum() for _, trusted, _ in parts])
    out = np.empty((len(parts[0][0]), ends[-1]))
    for own, (values, trusted, scale) in zip(np.split(out, ends[:-1], axis=1), parts, strict=True):
        np.divide(values[:, trusted], scale, out=own)
    return out


def layout(study: Study) -> Layout:
    """Describe the vectors that `stack` makes of a study's residuals."""
    recording, block, is_force, servo = [], [], [], []
    count = 0
    for index, (whole, own) in enumerate(study.sources):
        source, trusted = study.recordings[index], study.timeline(index).trusted
        place = ((source.time - source.time[0]) / BLOCK).astype(int)
        for force in (False, True) if compares_force(source) else (False,):
            recording.append(np.full(int(trusted.sum()), whole))
            block.append(count + place[trusted])
            is_force.append(np.full(int(trusted.sum()), force))
            servo.append(np.full(int(trusted.sum()), own))
        last = study.sources[index + 1 : index + 2] != ((whole, own + 1),)
        count += int(place[-1]) + 1 if last else 0
    return Layout(
        recording=np.concatenate(recording),
        block=np.concatenate(block),
        is_force=np.concatenate(is_force),
        servo=np.concatenate(servo),
        block_count=count,
    )


def loss_terms(scaled: Array) -> Array:
    """Return the loss of each entry: r^2 / 2 for a small one, logarithmic beyond `TAIL` scales."""
    return 0.5 * TAIL**2 * np.log1p((scaled / TAIL) ** 2)


def loss_weights(scaled: Array) -> Array:
    """Return the weights under which least squares has the gradient of the loss."""
    return 1.0 / (1.0 + (scaled / TAIL) ** 2)


def loss_curvatures(scaled: Array) -> Array:
    """Return the second derivatives of the loss by the residuals, those of the tails as zero."""
    share = (scaled / TAIL) ** 2
    return np.maximum(1.0 - share, 0.0) / (1.0 + share) ** 2


def group_sums(values: Array, groups: Indices, least_count: int = 0) -> Array:
    """Sum values by group, at least so many groups, shape (G,)."""
    # the copy that astype leaves out: with weights bincount is float64, though annotated as intp
    return np.bincount(groups, values, minlength=least_count).astype(np.float64, copy=False)
