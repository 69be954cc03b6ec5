"""An exam's figures count what they say, and its pages show them."""

from pathlib import Path

import pytest

from tendon_lab.exam.exam_rates import by_strength, confusion, rates
from tendon_lab.exam.exam_report import Matrix, write_exam_report
from tendon_lab.exam.exam_score import judge
from tests.lab.exam.made_up_exam import answer, marks, truth


def test_the_figures_are_what_a_hand_counts() -> None:
    """Four singles, two pairs, two clean ones and two outside, each answered in its own way."""
    found = {rate.name: (rate.value, rate.cases) for rate in rates(marks())}
    assert found["single: true cause named first"] == (0.25, 4)
    assert found["single: true cause first or in its class"] == (0.5, 4)
    assert found["single: not confidently wrong"] == (0.75, 4)
    assert found["clean: no cause named"] == (0.5, 2)
    assert found["clean: verdict no_gap"] == (0.5, 2)
    assert found["outside: no wrong name"] == (1.0, 2)
    assert found["pair: both found"] == (0.5, 2)
    assert found["pair: nothing else named"] == (0.5, 2)
    error, count = found["parameters: relative error, median"]
    assert (error, count) == (pytest.approx(0.1), 4)
    assert found["parameters: 95 % interval holds the truth"] == (1.0, 4)
    assert found["held-out gain over the true model's, median"] == (pytest.approx(1.0), 6)
    assert found["peak memory [MiB]"] == (600.0, 10)


def test_many_causes_are_counted_one_by_one_and_weak_ones_apart() -> None:
    """Of three and two causes three are found, beside one that is not there."""
    told = [
        judge(
            truth("l", "many", "gain_error", "tendon_slack", "deadband"),
            answer("explained", ("gain_error",), ("tendon_slack",), ("obstruction",)),
        ),
        judge(truth("m", "many", "gain_error", "deadband"), answer("explained", ("gain_error",))),
        judge(truth("n", "single", "deadband", weak=True), answer("no_gap")),
    ]
    found = {rate.name: (rate.value, rate.cases) for rate in rates(told)}
    assert found["many: recall"] == (0.6, 5)
    assert found["many: precision"] == (0.75, 4)
    assert found["many: all found and nothing else"] == (0.0, 2)
    assert found["weak: silent"] == (1.0, 1)
    assert "single: true cause named first" not in found


def test_a_class_of_more_than_three_is_no_answer() -> None:
    """The true cause among three names counts; among four only the first name does."""
    true = truth("k", "single", "command_delay")
    three = ("actuator_lag", "viscous_friction", "command_delay")
    assert judge(true, answer("explained", three)).in_class
    four = judge(true, answer("explained", (*three, "load_cell_delay")))
    assert not four.in_class
    assert four.classes == (("actuator_lag",),)


def test_the_gain_is_measured_by_the_true_models() -> None:
    """All of it where the true error is reached; (1 - 0.25) / (1 - 0.01) of it at half the error.

    None where nothing is hidden, as there is nothing to gain.
    """
    gains = {mark.truth.id: mark.gain for mark in marks()}
    assert gains["a"] == pytest.approx(1.0)
    assert gains["b"] == pytest.approx(0.75 / 0.99)
    assert gains["d"] == pytest.approx(0.0)
    assert gains["g"] is None


def test_weak_causes_are_seen_apart_from_strong_ones() -> None:
    """The single of half a noise floor stands in the lowest bin, unnamed."""
    bins = {b.low: b for b in by_strength(marks())}
    assert (bins[0.5].cases, bins[0.5].silent, bins[0.5].wrong) == (1, 1.0, 0.0)
    assert (bins[4.0].cases, bins[4.0].first, bins[4.0].wrong) == (2, 0.5, 0.5)
    assert bins[16.0].in_class == 1.0


def test_the_matrix_holds_every_case_but_pairs() -> None:
    """Rows and columns in the catalogue's order; right answers, by class too, count as accepted."""
    matrix = Matrix(marks())
    assert sum(sum(row.values()) for row in matrix.counts.values()) == 8
    assert matrix.counts == confusion(m for m in marks() if m.truth.family != "pair")
    assert ("command_delay", "command_delay") in matrix.accepted
    assert ("actuator_lag", "command_delay") in matrix.accepted
    assert ("command_delay", "actuator_lag") not in matrix.accepted
    assert ("nothing", "no_gap") in matrix.accepted


def test_the_summary_is_written(tmp_path: Path) -> None:
    """One page that needs nothing else, and the matrix as a picture."""
    write_exam_report(tmp_path, marks())
    text = (tmp_path / "exam.html").read_text(encoding="utf-8")
    assert "6 of 10 answers" in text
    assert "http" not in text
    assert (tmp_path / "confusion.png").read_bytes().startswith(b"\x89PNG")
