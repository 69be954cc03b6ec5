"""How much of an error is gone."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tendon_newton.diagnosis import diagnose as diagnosing
from tendon_newton.diagnosis import evaluation
from tendon_newton.diagnosis.diagnose import as_built, rivals
from tendon_newton.diagnosis.evaluation import (
    SquaredErrors,
    explained_fraction,
    is_in_doubt,
    with_whole_recordings,
)
from tendon_newton.diagnosis.findings import Findings
from tendon_newton.diagnosis.result import Errors
from tendon_newton.identification.noise_floor import NoiseFloor

NOISE = NoiseFloor(theta=4.4e-4, force=0.05)


def errors(theta: float, force: float) -> Errors:
    """Root mean squares of an angle [rad] and a force [N]."""
    return Errors(theta_rmse=theta, theta_mae=theta, force_rmse=force)


def test_a_signal_with_hardly_a_gap_does_not_decide() -> None:
    """A force's gap of twelve floors is closed; the angle goes from 1.3 to 1.7 floors."""
    share = explained_fraction(errors(5.7e-4, 0.6), errors(7.3e-4, 0.05), NOISE)
    assert share == pytest.approx(1.0, abs=1e-3)


def test_two_gaps_count_alike() -> None:
    """One of two large gaps is closed, the other stays."""
    share = explained_fraction(errors(1e-2, 1.0), errors(1e-2, 0.05), NOISE)
    assert share == pytest.approx(0.5, abs=1e-3)


def test_a_small_gap_that_doubles_weighs_by_the_large_one_that_closes() -> None:
    """A force goes from 17 floors to 5, the angle from 4 to 8; a gap alone counts by itself."""
    share = explained_fraction(errors(1.9e-3, 0.86), errors(3.7e-3, 0.26), NOISE)
    assert share == pytest.approx(0.5 * (0.912 - 0.177), abs=1e-2)
    alone = explained_fraction(errors(1.9e-3, 0.05), errors(2.5e-3, 0.05), NOISE)
    assert alone == pytest.approx((1.9**2 - 2.5**2) / (1.9**2 - 0.44**2), rel=1e-6)


def squares(theta: float) -> SquaredErrors:
    """Two blocks of ten rows whose angle is off by as much [rad]."""
    rows = np.full(2, 10.0)
    return SquaredErrors(
        signals={"theta": (rows * theta**2, rows), "force": (0.0 * rows, 0.0 * rows)},
        theta_abs=rows * theta,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("without", "plain", "doubted"),
    [(5e-3, 5e-3, False), (2e-3, 5e-3, True), (5e-3, 2.6e-3, False), (5e-3, 2.4e-3, True)],
)
def test_held_out_recordings_may_contradict_an_answer(without, plain, doubted) -> None:
    """Of 50 mrad 5 are left: fewer without a cause, or less than half under a plain model."""
    before, after = squares(50e-3), squares(5e-3)
    others = [squares(without)], [squares(plain)]
    assert is_in_doubt(before, after, *others, NOISE, highest=0.995) is doubted


@pytest.mark.parametrize(("left", "kept"), [(9e-3, True), (10e-3, True), (11e-3, False)])
def test_what_harms_on_whole_recordings_is_not_written(monkeypatch, left, kept) -> None:
    """A drift of 10 N in a whole log is 0.1 N in a piece of it; lag that slow logs hide is kept."""
    monkeypatch.setattr(
        evaluation, "evaluate_models", lambda _, models: [squares(e) for e in models]
    )
    answer, predictor = (SimpleNamespace(values=e) for e in (10e-3, left))
    found: Any = {"baseline": answer, "final": None, "closest": answer, "predictor": predictor}
    findings = Findings(verdict="unexplained", suspected=(), classes={}, candidates=(), **found)
    whole: Any = SimpleNamespace(noise=NOISE)
    found = with_whole_recordings(findings, whole, np.random.default_rng(0))
    assert (found.predictor is predictor) is kept


def test_an_answer_beside_nothing_is_no_comparison() -> None:
    """A report showed a table of one row, the answer itself."""
    findings: Any = SimpleNamespace(predicts=1.0, plain=())
    after: Any = SimpleNamespace(pooled=lambda: None)
    assert rivals(findings, ("viscous_friction",), after, ()) == ()


def test_what_is_too_far_off_what_is_stated_is_to_be_measured(monkeypatch) -> None:
    """4 % is what a ruler leaves, 8 % is not, and 1 % that may be none is not told.

    A load cell that is no cause is told as well: what it reads is nobody's secret.
    """
    numbers = {"mass": 0.025, "length": 0.025, "arm": 0.025, "scale": 0.015, "offset": 0.05}
    study: Any = SimpleNamespace(
        tolerated_columns=(0, 1, 2),
        base_value=lambda c: float(c < 4),
        parameter=lambda c: SimpleNamespace(
            name=list(numbers)[c], tolerance=list(numbers.values())[c], unit="N"
        ),
        table=SimpleNamespace(
            owners=[("bench", None)] * 3 + [("load_cell_gain", None), ("load_cell_bias", None)]
        ),
    )
    monkeypatch.setattr(diagnosing, "stated_columns", lambda _: (3, 4))
    ends = ((1.02, 1.06), (1.05, 1.11), (0.99, 1.03), (0.96, 1.01), (0.02, 0.06))
    values = dict(enumerate((1.04, 1.08, 1.01, 0.9706, 0.04)))
    found: Any = SimpleNamespace(values=values, intervals=ends, effects=())
    (text,) = as_built(study, found)
    assert "mass +4.0 %, length +8.0 %, load_cell_gain -2.9 %, load_cell_bias +0.04 N." in text
    assert text.endswith("Measure length, load_cell_gain: nothing stated is so far off.")
    found.effects = ("load_cell_gain",)
    assert "load_cell_gain" not in as_built(study, found)[0]
