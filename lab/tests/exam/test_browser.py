"""The exam's summary in a real browser."""

from pathlib import Path

from lab.tests.exam.made_up_exam import marks
from tendon_lab.exam.exam_report import write_exam_report
from tests.diagnosis.reporting.browser import WIDTHS, look_at

EXAM_LETTER = 6.0  # [px] of the matrix, which scrolls in its own box


def test_the_exams_summary_fits_too(browser: str, tmp_path: Path) -> None:
    """The wide matrix scrolls inside its own box, the page does not."""
    write_exam_report(tmp_path, marks())
    views, console = look_at(browser, tmp_path, ["exam.html"], WIDTHS)
    assert console == []
    for view in views:
        assert view.needed <= view.width, view
        assert view.letter >= EXAM_LETTER, view
        assert view.loaded == [], view
