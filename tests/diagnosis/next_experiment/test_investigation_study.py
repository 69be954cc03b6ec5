"""The study that holds investigations against fixed plans: how answers are scored."""

from dataclasses import asdict, replace
from pathlib import Path

from examples.studies.investigation.limits import Peak, limits_table
from examples.studies.investigation.one_unit import Answer, Result, read_result
from examples.studies.investigation.table import (
    comparison,
    information,
    is_dissolved,
    same_answer,
    score,
    unit_table,
)
from tendon_newton.data.files.json_file import write_json

FIRST = Answer(
    run="run_2 on finger",
    bench_seconds=24.0,
    wall_seconds=100.0,
    verdict="partly_explained",
    finished=True,
    named=("tilt", "gear_load_friction"),
    classes=(("tilt", "offset"),),
)
SECOND = replace(
    FIRST,
    run="run_3 on finger",
    bench_seconds=30.0,
    named=("tilt", "slack", "drift"),
    classes=(),
    expected={"a.x": 1.0, "a.y": 1.0, "b.z": 9.0},
    brought={"a.x": 2.0, "a.y": -0.5, "c.z": 9.0},
)
OWN = Result(
    unit=40,
    way="investigate",
    planted={"tilt": 0.3, "slack": 0.002},
    true=("load_dependent_friction", "slack", "tilt"),
    answers=(FIRST, SECOND),
    ended="",
)
QUICK = replace(
    OWN,
    way="quick",
    answers=(replace(FIRST, bench_seconds=72.0, classes=(("tilt", "offset"), ("a", "b"))),),
)


def test_a_result_is_read_as_it_was_written(tmp_path: Path) -> None:
    """With all its answers."""
    write_json(tmp_path / "result.json", asdict(OWN))
    assert read_result(tmp_path / "result.json") == OWN


def test_names_are_held_against_what_was_planted() -> None:
    """A gear that rubs by load is the unit's own, whatever its file calls it; drift is wrong."""
    first, second = score(OWN, FIRST), score(OWN, SECOND)
    assert (first.planted, first.own, first.wrong) == ({"tilt"}, ("gear_load_friction",), ())
    assert (second.planted, second.own, second.wrong) == ({"tilt", "slack"}, (), ("drift",))
    assert "2 of 2    0      1        0  partly_explained  goes on; tilt" in unit_table([OWN])


def test_the_same_answer_has_no_more_wrong_names_and_classes() -> None:
    """The first answer names what the plan named; an answer with a wrong name is not as good."""
    assert same_answer(OWN, QUICK) == FIRST
    assert same_answer(replace(OWN, answers=(SECOND,)), QUICK) is None


def test_a_class_that_nobody_names_is_not_dissolved() -> None:
    """One of it must be named, and no other stand beside it."""
    assert not is_dissolved(("tilt", "offset"), FIRST)
    assert is_dissolved(("tilt", "offset"), SECOND)
    assert not is_dissolved(("a", "b"), SECOND)
    text = comparison([OWN, QUICK], "quick")
    assert "as much after 24 s of 72 s" in text
    assert "as much in half the time on 1; planted causes named 2 against 1" in text
    assert "1 of 2 classes dissolved" in text
    assert comparison([OWN], "quick") == "against quick: no unit has both"


def test_information_counts_numbers_of_both_diagnoses() -> None:
    """2.0 bits were expected of these, and 1.5 came."""
    text = information([OWN])
    assert "2.0    1.5   2 numbers  within a factor of 2  other names" in text
    assert "1 of 1 runs within a factor of 2; where the names stayed 0 of 0" in text


def test_limits_count_searches_and_the_best_of_each() -> None:
    """A search that kept nothing is told; so is a command that passes under a drawn model."""
    best = Peak(
        seed=0, rank=0, diagnosis="d", bench="finger", command=(0.0, 1.0), designed=20.0,
        drawn=31.0, recorded=12.0, fault=None,
    )  # fmt: skip
    text = limits_table([0, 1], [best, replace(best, rank=1, drawn=22.0)])
    assert "2 searches, 1 of them kept no command" in text
    assert "2 commands, drawn: median 26.50 N, most 31.00 N, 1 beyond 30 N" in text
    assert "1 best ones, drawn: median 31.00 N, most 31.00 N, 1 beyond 30 N" in text
