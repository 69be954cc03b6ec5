"""The ideal force source, against which a network has to win."""

from collections.abc import Sequence

import numpy as np

from tendon_newton.data.recording import Array, Recording
from tendon_train.actuator.samples.windows import series

PAPER_GAIN = 4.2  # [N/rad], which the paper's authors found for their servo


def ideal_force(recording: Recording, tendon: int, gain: float, limit: float) -> Array:
    """Return max(0, P (theta_d - theta)), at most the limit [N], at every row, shape (T,)."""
    inputs, _ = series(recording, tendon)
    return np.clip(gain * (inputs[:, 0] - inputs[:, 1]), 0.0, limit)


def refitted_gain(recordings: Sequence[Recording], limit: float) -> float:
    """Return the gain [N/rad] with the least squared error over some recordings.

    A clipped row does not answer to the gain, so the best gain is the least-squares one over the
    rows that it leaves unclipped: a fixed point, reached from above.
    """
    pairs = [series(r, tendon) for r in recordings for tendon in range(r.tendon_count)]
    angle = np.concatenate([inputs[:, 0] - inputs[:, 1] for inputs, _ in pairs])
    force = np.concatenate([tension for _, tension in pairs])
    gain = PAPER_GAIN
    for _ in range(100):
        free = (angle > 0.0) & (gain * angle < limit)
        if not free.any():
            break
        refitted = float(angle[free] @ force[free] / (angle[free] @ angle[free]))
        if abs(refitted - gain) < 1.0e-9:
            break
        gain = refitted
    return gain
