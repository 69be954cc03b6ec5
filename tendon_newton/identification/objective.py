"""The robust loss of residuals, in units of what may be left over, by row and by block of time."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from tendon_newton.data.recording import Array, Indices, Mask
from tendon_newton.identification.signals import SIGNALS, Scales
from tendon_newton.identification.study import Residual, Study

TAIL = 3.0
"""Residuals beyond this many scales count logarithmically: rows of a jump must not decide."""
BLOCK = 1.0  # Length [s] of the blocks whose losses are compared; the mechanisms forget faster


@dataclass(frozen=True, kw_only=True)
class Layout:
    """Where each entry of a residual vector comes from, shape (M,) each."""

    recording: Indices  # Index of the whole recording
    block: Indices  # Index of the block of time, counted through all recordings
    signal: Indices  # Place of its signal in `SIGNALS`
    part: Indices  # Number of its servo, or of its component where servos share a signal
    block_count: int  # Number of blocks B

    @cached_property
    def signals(self) -> tuple[tuple[str, Mask], ...]:
        """Each part of each signal: the signal's name, and its entries, shape (M,).

        Those of one servo stand together, before those that servos share.
        """
        rows = tuple(SIGNALS.items())
        there = sorted(
            set(zip(self.signal.tolist(), self.part.tolist(), strict=True)),
            key=lambda own: (False, *own[::-1]) if rows[own[0]][1].by_servo else (True, *own),
        )
        return tuple((rows[k][0], (self.signal == k) & (self.part == part)) for k, part in there)

    def sizes(self, scales: Scales) -> Array:
        """Return the size of each entry's signal, shape (M,)."""
        sizes = np.zeros(len(SIGNALS))
        for k in np.unique(self.signal):
            sizes[k] = scales.of(tuple(SIGNALS)[k])
        return sizes[self.signal]


def stack(residuals: Sequence[Residual]) -> Array:
    """Return residuals of all signals, each in its unit, untrusted rows left out, shape (N, M)."""
    parts = [(own[:, c], residual.trusted) for residual in residuals
             for own in residual.signals.values() for c in range(own.shape[1])]  # fmt: skip
    ends = np.cumsum([trusted.sum() for _, trusted in parts])
    out = np.empty((len(parts[0][0]), ends[-1]))
    for own, (values, trusted) in zip(np.split(out, ends[:-1], axis=1), parts, strict=True):
        own[:] = values[:, trusted]
    return out


def layout(study: Study) -> Layout:
    """Describe the vectors that `stack` makes of a study's residuals."""
    recording, block, signal, part = [], [], [], []
    count, names = 0, list(SIGNALS)
    for index, (whole, servo) in enumerate(study.sources):
        source, trusted = study.recordings[index], study.timeline(index).trusted
        place, rows = ((source.time - source.time[0]) / BLOCK).astype(int), int(trusted.sum())
        for name, components in study.compared[index].items():
            for c in range(len(components)):
                recording.append(np.full(rows, whole))
                block.append(count + place[trusted])
                signal.append(np.full(rows, names.index(name)))
                part.append(np.full(rows, servo if SIGNALS[name].by_servo else c))
        last = study.sources[index + 1 : index + 2] != ((whole, servo + 1),)
        count += int(place[-1]) + 1 if last else 0
    return Layout(
        recording=np.concatenate(recording),
        block=np.concatenate(block),
        signal=np.concatenate(signal),
        part=np.concatenate(part),
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
