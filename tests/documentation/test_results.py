"""Tables of results are those of their records, and a record knows its code."""

from pathlib import Path

import pytest

from tests.results.__main__ import with_table
from tests.results.record import ROOT, fingerprint, records
from tests.results.tables import TABLES


@pytest.mark.parametrize("name", TABLES)
def test_a_page_shows_what_was_measured(name: str) -> None:
    """``python -m tests.results --write`` would change nothing."""
    page, make = TABLES[name]
    text = (ROOT / page).read_text(encoding="utf-8")
    assert with_table(text, name, make(records())) == text


def test_a_number_that_was_edited_by_hand_is_noticed() -> None:
    """A table with another number is not that of its record."""
    page, make = TABLES["readme"]
    text = (ROOT / page).read_text(encoding="utf-8")
    edited = text.replace("264 times", "265 times")
    assert edited != text
    assert with_table(edited, "readme", make(records())) == text


def test_a_docstring_changes_no_result_and_a_number_does(tmp_path: Path) -> None:
    """A fingerprint is of the code alone, and of the numbers that it reads."""
    file = tmp_path / "law.py"
    file.write_text('"""Old words."""\nMU = 0.1  # source\n')
    before = fingerprint(tmp_path, "law.py")
    file.write_text('"""New words."""\n\nMU = 0.1\n')
    assert fingerprint(tmp_path, "law.py") == before
    file.write_text('"""New words."""\n\nMU = 0.2\n')
    assert fingerprint(tmp_path, "law.py") != before


@pytest.mark.parametrize("record", records().values(), ids=records())
def test_a_record_is_complete(record) -> None:
    """What measures it again, on what it was measured, and the code that it rests on."""
    assert record.command
    assert record.minutes > 0
    assert record.code
    assert all(record.code.values()), "python -m tests.results --stamp NAME"
    assert record.figures
