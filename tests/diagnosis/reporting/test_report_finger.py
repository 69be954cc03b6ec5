"""The report's finger moves as the recording and the models say, without any script."""

import re
from pathlib import Path

import numpy as np
import pytest

from tendon_newton.diagnosis.diagnose import Evidence
from tendon_newton.diagnosis.held_out import WINDOW, compare, telling_windows
from tendon_newton.diagnosis.reporting.report import write_report
from tendon_newton.diagnosis.reporting.report_finger import FRAMES, WIDTH, moving_fingers
from tendon_newton.mechanisms.geometry.closing_postures import ClosingPostures
from tendon_newton.mechanisms.loading import load_mechanism
from tests.diagnosis.made_up import diagnosis, evidence
from tests.diagnosis.reporting.browser import find_browser, look_at

PATH = re.compile(r'<path class="bones (\w+)" d="([^"]*)"><animate attributeName="d" ([^>]*)/>')


@pytest.fixture(scope="module")
def finger() -> Evidence:
    """Evidence of the finger."""
    return evidence(bench="finger")


def motions(text: str) -> dict[str, list[str]]:
    """Return the pictures of each finger of a page, as paths, by what it shows."""
    found = {}
    for style, first, attributes in PATH.findall(text):
        values = re.search(r'values="([^"]*)"', attributes)
        assert values is not None
        found[style] = values[1].split(";")
        assert found[style][0] == first
        assert f'dur="{WINDOW:g}s"' in attributes
    return found


def test_three_fingers_move_together(finger: Evidence, tmp_path: Path) -> None:
    """Measured, starting model and causes: as many pictures each, and the models differ."""
    path = tmp_path / "report.html"
    write_report(path, diagnosis("explained"), finger)
    found = motions(path.read_text(encoding="utf-8"))
    assert list(found) == ["measured", "before", "after"]
    assert {len(frames) for frames in found.values()} == {round(WINDOW * FRAMES)}
    assert found["before"] != found["after"]
    assert len(set(found["measured"])) > 10, "it moves"


def test_without_causes_one_model_is_shown(finger: Evidence, tmp_path: Path) -> None:
    """Both models are the same then."""
    path = tmp_path / "report.html"
    write_report(path, diagnosis("unexplained"), finger)
    assert list(motions(path.read_text(encoding="utf-8"))) == ["measured", "before"]


def test_bones_stand_where_the_motor_says(finger: Evidence) -> None:
    """All pictures have one scale: a bone is as long in each, and bends as its angle does."""
    windows = telling_windows(compare(finger), gap=True)
    shown = moving_fingers(finger, diagnosis("explained").model, windows, found=True)
    assert shown is not None
    frames = motions(shown["pictures"][0]["svg"])["measured"]
    postures = ClosingPostures(load_mechanism("finger"))
    window = windows[0]
    row = int(np.searchsorted(window.comparison.time, window.start))
    angle = float(window.comparison.recording.motor_position[row, 0])
    expected = postures.bones(postures.joints_at(angle))
    ends = np.array(re.findall(r"[\d.]+ [\d.]+", frames[0]))
    drawn = np.array([[float(x) for x in end.split()] for end in ends]).reshape(-1, 2, 2)
    scale = np.linalg.norm(np.diff(drawn, axis=1)) / np.linalg.norm(np.diff(expected, axis=1))
    turned = np.diff(drawn, axis=1) / scale
    assert turned == pytest.approx(np.diff(expected, axis=1), abs=0.1 / scale)
    assert drawn.min() >= 0.0
    assert drawn[..., 0].max() <= WIDTH


def test_springs_have_no_finger(tmp_path: Path) -> None:
    """A carriage is not drawn."""
    path = tmp_path / "report.html"
    write_report(path, diagnosis("explained"), evidence())
    assert motions(path.read_text(encoding="utf-8")) == {}


def test_the_fingers_fit_a_phone(finger: Evidence, tmp_path: Path) -> None:
    """No sideways scrolling, nothing on the console, and all three beside each other."""
    browser = find_browser()
    if browser is None:
        pytest.skip("needs Chromium (Debian: apt-get install chromium)")
    write_report(tmp_path / "finger.html", diagnosis("explained"), finger)
    views, console = look_at(browser, tmp_path, ["finger.html"], (1280, 400))
    assert console == []
    for view in views:
        assert view.needed <= view.width, view
        assert min(view.drawings) > 100.0, view
