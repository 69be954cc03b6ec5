"""The reports in a real browser: they ask for nothing, complain of nothing, and fit a phone."""

from pathlib import Path

import pytest

from tendon_newton.diagnosis.reporting.report import write_report
from tests.diagnosis.made_up import VERDICTS, diagnosis, evidence
from tests.diagnosis.reporting.browser import find_browser, look_at

WIDTHS = (1280, 400)  # [px] a desk and a phone
LEAST_LETTER = 8.0  # [px] smaller letters are guessed, not read


@pytest.fixture(scope="module")
def browser() -> str:
    """Path of Chromium; the tests that need it are skipped without one."""
    found = find_browser()
    if found is None:
        pytest.skip("needs Chromium (Debian: apt-get install chromium)")
    return found


def test_every_report_fits_a_desk_and_a_phone(browser: str, tmp_path: Path) -> None:
    """No sideways scrolling, letters that can be read, no request, nothing on the console."""
    shown = evidence()
    for verdict in VERDICTS:
        write_report(tmp_path / f"{verdict}.html", diagnosis(verdict), shown)
    pages = [f"{verdict}.html" for verdict in VERDICTS]
    views, console = look_at(browser, tmp_path, pages, WIDTHS)
    assert console == []
    assert len(views) == len(pages) * len(WIDTHS)
    for view in views:
        assert view.needed <= view.width, view
        assert view.letter >= LEAST_LETTER, view
        assert min(view.drawings) > 0.7 * min(view.width, 500), view
        assert view.loaded == [], view
        assert view.height > 2000, view


def test_the_browser_would_notice(browser: str, tmp_path: Path) -> None:
    """A page too wide, with a picture from elsewhere and a broken drawing, is caught each time."""
    (tmp_path / "bad.html").write_text(
        '<p style="width: 900px">wide</p><img src="http://elsewhere.invalid/dot.png">'
        '<svg viewBox="0 0 100 100" width="50"><path d="M 0 zero"/>'
        '<text font-size="9">x</text></svg>'
    )
    (view,), console = look_at(browser, tmp_path, ["bad.html"], [400])
    assert view.needed > view.width
    assert view.loaded == ["http://elsewhere.invalid/dot.png"]
    assert view.letter < LEAST_LETTER
    assert any("attribute d" in line for line in console)
