"""The study that holds investigations against a fixed plan: how results are compared."""

from dataclasses import asdict, replace
from pathlib import Path

from examples.studies.investigation.limits import Peak, limits_table
from examples.studies.investigation.one_unit import Result, read_result
from examples.studies.investigation.table import comparison, information, unit_table
from tendon_newton.data.files.json_file import write_json

OWN = Result(
    unit=40,
    way="investigate",
    planted={"tilt": 0.3, "slack": 0.002},
    found=("tilt", "slack"),
    named=3,
    deserved=2,
    theta=0.02,
    force=0.1,
    runs=(
        {"names": 0.5, "names_came": 0.3, "task": 1.0, "task_came": -0.2, "seconds": 20.0},
        {"names": 0.01, "names_came": 2.0, "task": 1.0, "task_came": 1.2},
    ),
    ended="the time at the bench is spent",
)
QUICK = replace(OWN, way="quick", found=("tilt",), named=3, deserved=1, theta=0.08, runs=())


def test_a_result_is_read_as_it_was_written(tmp_path: Path) -> None:
    """With all its runs."""
    write_json(tmp_path / "result.json", asdict(OWN))
    assert read_result(tmp_path / "result.json") == OWN
    assert "40  investigate  2 of 2     2 of  3            20.0   0.100  the time" in unit_table(
        [OWN]
    )


def test_units_are_compared_in_pairs() -> None:
    """Half the error is one binary order less; a unit without its pair does not count."""
    text = comparison([OWN, QUICK, replace(OWN, unit=41)])
    assert text.startswith("1 units, investigation of 72 s less plan")
    assert "planted causes named: mean +1.00 [+1.00, +1.00]; more on 1, fewer on 0" in text
    assert "undeserved names: mean -1.00" in text
    assert "log2 of held-out error: mean -1.00" in text
    assert comparison([OWN]) == "no unit was looked at in both ways"


def test_information_that_came_is_held_against_what_was_predicted() -> None:
    """A run of which nothing was predicted does not count; one brought less than nothing."""
    text = information([OWN])
    assert "names: 1 of 1 within a factor of 2; 0.3 of 0.5 bits in all" in text
    assert "task: 1 of 2 within a factor of 2; 1.0 of 2.0 bits in all" in text
    assert "median 20 s" in text


def test_limits_count_searches_and_the_best_of_each() -> None:
    """A search that kept nothing is told; so is a command that passes under a drawn model."""
    best = Peak(
        seed=0, rank=0, moment="d", bench="finger", command=(0.0, 1.0), designed=20.0,
        drawn=31.0, recorded=12.0, fault=None,
    )  # fmt: skip
    text = limits_table([0, 1], [best, replace(best, rank=1, drawn=22.0)])
    assert "2 searches, 1 of them kept no command" in text
    assert "2 commands, drawn: median 26.50 N, most 31.00 N, 1 beyond 30 N" in text
    assert "1 best ones, drawn: median 31.00 N, most 31.00 N, 1 beyond 30 N" in text
