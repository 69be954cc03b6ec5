"""Causes that no set holds: a run counts by what it tells of them, too."""

from dataclasses import replace

import numpy as np
import pytest

from tendon_newton.diagnosis.explanation import Setting
from tendon_newton.diagnosis.next_experiment.by_hand import best_by_hand
from tendon_newton.diagnosis.next_experiment.expected_run import Forecast
from tendon_newton.diagnosis.next_experiment.further_causes import (
    ACTING,
    Seen,
    chances,
    entropy,
    told_of,
)
from tendon_newton.diagnosis.next_experiment.planned_runs import plan_run
from tests.diagnosis.next_experiment.test_run_design import open_sets, task


def test_rows_that_show_a_cause_settle_whether_it_acts() -> None:
    """Nothing is told by rows that it does not change, and all that was open by many that it does.

    A cause that earlier rows would have shown is not open any more.
    """
    chance = np.full(3, ACTING)
    nothing, some, much = told_of(chance, np.array([0.0, 8.0, 1.0e4]))
    assert nothing == pytest.approx(0.0, abs=1e-12)
    assert 0.0 < some < much
    assert much == pytest.approx(entropy(chance)[0])
    fresh, ruled_out = entropy(chances(np.array([0.0, 1.0e4])))
    assert fresh == pytest.approx(0.469, abs=1e-3)  # entropy of one in ten
    assert ruled_out == pytest.approx(0.0, abs=1e-12)


def test_a_number_that_may_be_anything_hides_a_cause_like_it() -> None:
    """What a cause changes along a free number tells nothing of it; beside a known one it does."""
    alike = Seen(
        numbers=np.array([[4.0]]), along=np.array([[6.0, 0.0]]), causes=np.array([9.0, 9.0])
    )
    hidden, plain = alike.apart(np.array([[1.0e9]]))
    assert hidden == pytest.approx(0.0, abs=1e-6)
    assert plain == pytest.approx(9.0)
    np.testing.assert_allclose(alike.apart(np.array([[1.0e-9]])), [9.0, 9.0], rtol=1e-6)
    np.testing.assert_allclose((2.0 * alike).causes, (alike + alike).causes)


def test_what_no_set_holds_is_open_until_a_run_would_have_shown_it() -> None:
    """Of a tilt alone some forty further causes are open, fewer the more runs show none of them."""
    tilt = open_sets(0.1, ("gravity_misalignment", 0.3))
    further = replace(tilt, looks_further=True)
    runs = [plan_run(Setting(bench="finger"), name, 0, 4.0) for name in ("ramps", "random_steps")]
    alone = Forecast(tilt, runs[:1], task(), 1.0e-3)
    early, late = (Forecast(further, runs[:count], task(), 1.0e-3) for count in (1, 2))
    assert alone.entropy == pytest.approx(0.0)
    assert "gravity_misalignment" not in early.further
    assert "obstruction" not in early.further
    assert early.entropy > late.entropy > 0.0
    (expected,) = early.runs(runs[1:])
    assert 0.0 < expected.told.names < early.entropy
    assert alone.runs(runs[1:])[0].told.names == pytest.approx(0.0)


def test_a_caliper_counts_though_no_set_holds_the_spool() -> None:
    """Its radius is open beside the likeliest set; a measurement in two minutes settles it."""
    question = replace(open_sets(0.1, ("gravity_misalignment", 0.3)), looks_further=True)
    worth = best_by_hand(Forecast(question, [], task(), 1.0e-3))
    assert worth is not None
    assert worth.told.names > 0.3  # of 0.47 for each cause that is wholly open
