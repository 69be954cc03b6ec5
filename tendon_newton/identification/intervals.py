"""How well a fit knows its numbers."""

from __future__ import annotations

import numpy as np
from scipy import stats

from tendon_newton.identification.least_squares import Candidate, Linearisation, invertible
from tendon_newton.identification.objective import Layout, loss_weights
from tendon_newton.recording import Array

WIDENING = 1.5
"""Blocks of time are few, alike, and share the model's error of form: scatter alone held 8 in 10
truths of planted causes, this factor 19 in 20."""
LEAST_SHARE = 1.0e-3
"""Share of a value that step size and simplified sensors leave open, whatever the noise."""


def intervals(candidate: Candidate, point: Linearisation, where: Layout) -> Array:
    """Return 95 % intervals of a fit's parameters, shape (F, 2).

    The scatter of the gradient between blocks of time stands for the noise (a sandwich estimate),
    so rows inside a block may be correlated and the noise need not be known; recordings as blocks
    give a second estimate, and the wider one counts.
    """
    inverse = np.linalg.inv(invertible(point.normal_matrix()))
    weighted = (loss_weights(point.residual) * point.residual)[:, None] * point.jacobian
    variances = []
    for groups in (where.block, where.recording):
        count = int(groups.max()) + 1
        sums = np.stack([np.bincount(groups, column, minlength=count) for column in weighted.T], 1)
        centred = sums - sums.mean(axis=0)
        present = len(np.unique(groups))
        spread = centred.T @ centred * present / max(1, present - 1)
        quantile = stats.t.ppf(0.975, max(1, present - 1))
        variances.append(np.sqrt(np.diag(inverse @ spread @ inverse)) * quantile)
    half = np.maximum(variances[0], np.minimum(variances[1], 3.0 * variances[0]))
    half = WIDENING * half + LEAST_SHARE * np.abs(candidate.value)
    return np.stack(
        [
            np.maximum(candidate.value - half, candidate.lower),
            np.minimum(candidate.value + half, candidate.upper),
        ],
        axis=1,
    )
