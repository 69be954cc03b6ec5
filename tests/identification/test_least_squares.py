"""Many small robust least-squares problems at once."""

import numpy as np
import pytest

from tendon_newton.identification.least_squares import (
    Candidate,
    choose_start,
    linearise,
    refine,
)

TIMES = np.linspace(0.0, 2.0, 200)


def decay(columns: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Residuals of y = exp(-2 t) + 0.5 against a exp(-b t) + c; columns 0, 1, 2 are a, b, c."""
    model = np.array([1.0, 2.0, 0.5]) * np.ones((len(values), 1))
    for n, row in enumerate(columns):
        for f in np.flatnonzero(row >= 0):
            model[n, row[f]] = values[n, f]
    a, b, c = model.T[:, :, None]
    measured = np.exp(-2.0 * TIMES) + 0.5
    return measured - (a * np.exp(-b * TIMES) + c)


def candidate(columns: tuple[int, ...], value: list[float], upper: float = 10.0) -> Candidate:
    """A candidate with all bounds at 0 and ``upper``."""
    size = len(columns)
    return Candidate(
        name="decay",
        columns=columns,
        lower=np.zeros(size),
        upper=np.full(size, upper),
        value=np.array(value),
    )


def test_each_candidate_finds_its_own_optimum() -> None:
    """Problems of different sizes and starts are solved side by side."""
    problems = [
        candidate((1,), [5.0]),
        candidate((0, 1), [3.0, 0.5]),
        candidate((0, 1, 2), [0.2, 6.0, 0.0]),
    ]
    found = refine(decay, problems, iterations=30)
    assert found[0].value == pytest.approx([2.0], rel=1e-3)
    assert found[1].value == pytest.approx([1.0, 2.0], rel=1e-3)
    assert found[2].value == pytest.approx([1.0, 2.0, 0.5], rel=1e-2)


def test_a_number_that_is_never_zero_changes_by_a_factor_of_two_in_a_step() -> None:
    """From a flat tail the undamped step runs to a bound, where another valley may be."""
    free = candidate((1,), [9.0])
    scale = Candidate(**{**vars(free), "lower": np.array([0.1])})
    assert refine(decay, [scale], iterations=1)[0].value[0] >= 4.5
    assert refine(decay, [scale], iterations=10)[0].value == pytest.approx([2.0], rel=1e-3)


def test_a_bound_holds_and_does_not_move_the_others() -> None:
    """With b held at 1.5 by its bound, a and c are the best for that b."""
    bounded = candidate((0, 1, 2), [1.0, 1.0, 0.5])
    bounded = Candidate(**{**vars(bounded), "upper": np.array([10.0, 1.5, 10.0])})
    found = refine(decay, [bounded], iterations=30)[0]
    basis = np.stack([np.exp(-1.5 * TIMES), np.ones_like(TIMES)], axis=1)
    best = np.linalg.lstsq(basis, np.exp(-2.0 * TIMES) + 0.5, rcond=None)[0]
    assert found.value[1] == 1.5
    assert found.value[[0, 2]] == pytest.approx(best, rel=1e-3)


def test_a_few_wild_rows_do_not_decide() -> None:
    """Outliers of a hundred scales in 3 % of the rows move the optimum by less than 1 %."""

    def spoiled(columns: np.ndarray, values: np.ndarray) -> np.ndarray:
        residual = decay(columns, values) / 0.01
        residual[:, ::33] += 100.0
        return residual

    found = refine(spoiled, [candidate((0, 1), [0.9, 1.8])], iterations=30)[0]
    assert found.value == pytest.approx([1.0, 2.0], rel=1e-2)


def test_the_best_start_is_chosen_for_each_candidate() -> None:
    """Starts are compared within a candidate, not between candidates."""
    starts = [np.array([[9.0], [2.1], [0.1]]), np.array([[0.1, 9.0], [1.1, 2.2]])]
    chosen = choose_start(decay, [candidate((1,), [9.0]), candidate((0, 1), [0.1, 9.0])], starts)
    assert chosen[0].value == pytest.approx([2.1])
    assert chosen[1].value == pytest.approx([1.1, 2.2])


def test_the_jacobian_is_the_derivative_of_the_residual() -> None:
    """Forward differences agree with the analytic slope to first order in their default step."""
    point = linearise(decay, [candidate((1,), [2.0])])[0]
    slope = TIMES * np.exp(-2.0 * TIMES)
    assert point.jacobian[:, 0] == pytest.approx(slope, abs=2e-3)  # step 0.01 times half of t^2
