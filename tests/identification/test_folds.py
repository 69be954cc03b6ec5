"""A fit that does not see some rows ends where those rows say nothing."""

import numpy as np

from tendon_newton.identification.folds import value_without
from tendon_newton.identification.least_squares import Candidate, Linearisation

ROWS, LEFT_OUT = 400, 100
SMALL = 1.0e-4
"""Size of the residuals [1]: so small that the robust loss is half their square."""


def line(rng: np.random.Generator, wrong: float) -> tuple[Candidate, Linearisation, np.ndarray]:
    """Fit a line to rows of which the first hundred are off; return fit, rows and the fit without.

    Args:
        rng: Of the rows.
        wrong: By how much the numbers are different in these rows [1].
    """
    columns = rng.standard_normal((ROWS, 2))
    truth = np.where(np.arange(ROWS)[:, None] < LEFT_OUT, [1.0 + wrong, -0.5], [1.0, -0.5])
    measured = SMALL * (columns * truth).sum(axis=1)
    jacobian = -SMALL * columns
    value = np.linalg.lstsq(-jacobian, measured)[0]
    alone = np.linalg.lstsq(-jacobian[LEFT_OUT:], measured[LEFT_OUT:])[0]
    bound = np.full(2, 10.0)
    candidate = Candidate(name="line", columns=(0, 1), lower=-bound, upper=bound, value=value)
    residual = measured + jacobian @ value
    return candidate, Linearisation(residual=residual, jacobian=jacobian), alone


def test_a_fold_has_the_fit_of_all_other_rows(rng: np.random.Generator) -> None:
    """A step from the optimum of all rows is exact on a line: it ends where the others alone do."""
    candidate, point, alone = line(rng, wrong=0.3)
    found = value_without(candidate, point, np.arange(ROWS) < LEFT_OUT)
    # 1e-6: what the robust loss is off half a square at residuals of 1e-4
    np.testing.assert_allclose(found, alone, rtol=1e-6)
    assert abs(candidate.value[0] - alone[0]) > 0.05


def test_what_a_fold_holds_does_not_move_its_fit(rng: np.random.Generator) -> None:
    """Other measurements in the rows that are left out: the same numbers, to the last bit."""
    candidate, point, _ = line(rng, wrong=0.0)
    hidden = np.arange(ROWS) < LEFT_OUT
    other = point.residual + np.where(hidden, SMALL * rng.standard_normal(ROWS), 0.0)
    moved = Linearisation(residual=other, jacobian=point.jacobian)
    np.testing.assert_array_equal(
        value_without(candidate, moved, hidden), value_without(candidate, point, hidden)
    )


def test_a_fold_stays_in_bounds(rng: np.random.Generator) -> None:
    """Friction cannot turn negative because a few rows are missing."""
    candidate, point, alone = line(rng, wrong=0.3)
    held = Candidate(
        name="line",
        columns=(0, 1),
        lower=np.array([1.05, -10.0]),
        upper=candidate.upper,
        value=candidate.value,
    )
    assert alone[0] < 1.05 < candidate.value[0]
    assert value_without(held, point, np.arange(ROWS) < LEFT_OUT)[0] == 1.05
