"""Quadratics with bounds, against SciPy's own solver."""

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from tendon_newton.identification.quadratic import bounded


@pytest.mark.parametrize("seed", range(5))
def test_the_least_within_bounds_is_that_of_another_solver(seed: int) -> None:
    """Eight unknowns whose directions hardly overlap: some end at a bound, none beyond."""
    rng = np.random.default_rng(seed)
    directions = np.linalg.qr(rng.normal(size=(20, 8)))[0] + 0.01 * rng.normal(size=(20, 8))
    target = rng.normal(size=20)
    low, high = np.full(8, -0.2), np.full(8, 0.3)
    x = bounded(directions.T @ directions, directions.T @ target, low, high)
    expected = lsq_linear(directions, target, (low, high), tol=1e-12).x
    assert 0 < np.sum((x == low) | (x == high)) < 8
    assert x == pytest.approx(expected, abs=1e-4)


def test_nothing_unknown_is_nothing_solved() -> None:
    """An empty quadratic has an empty solution."""
    none = np.zeros(0)
    assert bounded(np.zeros((0, 0)), none, none, none).shape == (0,)
