"""What is written of days: pages and JSON, whatever a day lacks and however large a number is."""

import json
import math
from dataclasses import replace
from pathlib import Path

import pytest

from tendon_newton.data.files.json_file import refuse_constant
from tendon_newton.diagnosis.in_time.changes import Change, Changes
from tendon_newton.diagnosis.in_time.changes_report import row, sentence, told, write_changes
from tendon_newton.diagnosis.result import Errors
from tests.physics.runs import ideal_model

SLACK = Change(
    cause="tendon_slack",
    name="length",
    unit="m",
    before=0.001,
    value=0.002,
    ci95=(0.0015, 0.0025),
    moved=False,
    probability=0.4,
)
STRETCHY = replace(
    SLACK,
    cause="tendon_compliance",
    name="stiffness",
    unit="N/m",
    before=math.inf,
    value=3.0e4,
    ci95=(2.0e4, math.inf),
    moved=True,
)
"""A string that did not stretch on the first day."""


def day(*numbers: Change) -> Changes:
    """Return what is said of a day."""
    errors = Errors(theta_rmse=0.01, theta_mae=0.01, force_rmse=None)
    return Changes(numbers=numbers, before=errors, after=errors, usual=None, model=ideal_model())


@pytest.mark.parametrize("lacking", [0, 1])
def test_a_day_without_a_number_has_no_place_in_its_course(lacking: int, tmp_path: Path) -> None:
    """The load cell was away for a day: its numbers are drawn for the other days."""
    days = [day(SLACK, STRETCHY), day(SLACK, STRETCHY)]
    days[lacking] = day(SLACK)
    write_changes(tmp_path, {"monday": days[0], "tuesday": days[1]}, "sunday")
    page = (tmp_path / "changes.html").read_text()
    assert page.count("<figure>") == len(days[1].numbers)
    assert ("over 1 days" in page) == (lacking == 0)


def test_a_number_that_was_infinite_is_written_and_said(tmp_path: Path) -> None:
    """JSON has no infinity, and nothing falls by it."""
    write_changes(tmp_path, {"monday": day(STRETCHY)}, "sunday")
    text = (tmp_path / "changes.json").read_text()
    (number,) = json.loads(text, parse_constant=refuse_constant)["days"]["monday"]["numbers"]
    assert (number["before"], number["value"], number["ci95"]) == (None, 3.0e4, [2.0e4, None])
    assert sentence(STRETCHY).startswith("The stiffness of the tendon is now 30.0 N/mm: ")
    assert row(STRETCHY)["before"] == "∞ N/mm"
    assert row(STRETCHY)["interval"] == "20 to ∞ N/mm"


def test_a_mend_is_said_to_have_moved_a_number_or_not() -> None:
    """What somebody mended is told either way: a cause that stays was not mended, or was none."""
    gone = replace(SLACK, before=0.002, value=0.0, ci95=(0.0, 0.0004), moved=True, mended=True)
    assert (
        sentence(gone) == "The slack has fallen by 2.00 mm, as it was mended: take the new model."
    )
    stays = replace(SLACK, mended=True)
    assert sentence(stays) == (
        "The slack was mended and has not moved, as far as these recordings can tell: it was "
        "1.00 mm, and is 2.00 mm (1.50 to 2.50 mm)."
    )
    assert told(day(stays, STRETCHY, SLACK)) == [stays, STRETCHY]
