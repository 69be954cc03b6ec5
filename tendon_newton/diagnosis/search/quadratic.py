"""Quadratics with bounds: what a choice of causes and a step of a refit both solve."""

from __future__ import annotations

import numpy as np

from tendon_newton.data.recording import Array


def bounded(matrix: Array, vector: Array, low: Array, high: Array) -> Array:
    """Return the least of x A x / 2 - b x within bounds, by active sets, shape (F,)."""
    count = len(vector)
    x = np.zeros(count)
    if count == 0:
        return x
    matrix = matrix + 1.0e-9 * np.diag(np.diag(matrix) + 1.0e-30)
    fixed = np.zeros(count, dtype=bool)
    for _ in range(count + 1):
        free = ~fixed
        right = vector[free] - matrix[np.ix_(free, fixed)] @ x[fixed]
        x[free] = np.linalg.solve(matrix[np.ix_(free, free)], right)
        out = free & ((x < low) | (x > high))
        if not out.any():
            break
        excess = np.where(out, np.maximum(low - x, x - high), -np.inf)
        worst = int(np.argmax(excess / np.maximum(high - low, 1e-12)))
        x[worst] = np.clip(x[worst], low[worst], high[worst])
        fixed[worst] = True
    return np.clip(x, low, high)
