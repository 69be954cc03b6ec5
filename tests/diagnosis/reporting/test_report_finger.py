"""The report's finger moves as the recording and the models say, without any script."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tendon_newton.data.files.picture import save
from tendon_newton.data.recording import Recording
from tendon_newton.data.recording_plot import recording_figure
from tendon_newton.diagnosis.diagnose import Evidence
from tendon_newton.diagnosis.reporting.held_out import WINDOW, compare, telling_windows
from tendon_newton.diagnosis.reporting.report import write_report
from tendon_newton.diagnosis.reporting.report_finger import (
    FRAMES,
    WIDTH,
    ClosingPostures,
    moving_fingers,
)
from tendon_newton.mechanisms.geometry.parts import excursion
from tendon_newton.mechanisms.geometry.statics import equilibrium
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.simulation.hosts.rollout import Trajectory
from tests.diagnosis.made_up import diagnosis, evidence
from tests.diagnosis.reporting.browser import find_browser, look_at
from tests.made import recorded

PATH = re.compile(r'<path class="bones (\w+)" d="([^"]*)"><animate attributeName="d" ([^>]*)/>')


@pytest.fixture(scope="module")
def finger() -> Evidence:
    """Evidence of the finger."""
    return evidence(bench="finger")


@pytest.fixture(scope="module")
def explained(finger: Evidence, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The page of a finger whose cause was found."""
    path = tmp_path_factory.mktemp("explained") / "finger.html"
    write_report(path, diagnosis("explained"), finger)
    return path


def motions(text: str) -> dict[str, list[str]]:
    """Return the pictures of each finger of a page, as paths, by what it shows."""
    found = {}
    for style, first, attributes in PATH.findall(text):
        values = re.search(r'values="([^"]*)"', attributes)
        found[style] = values[1].split(";")
        assert found[style][0] == first
        assert f'dur="{WINDOW:g}s"' in attributes
    return found


def test_the_finger_stands_where_its_motor_says() -> None:
    """The posture's excursion is the motor's angle times the spool's radius, l = r theta."""
    postures = ClosingPostures(load_mechanism("finger"))
    (tendon,) = postures.mechanism.tendons
    for angle in (0.2, 0.3, 1.0):
        wound = float(excursion(tendon, postures.joints_at(angle)))
        assert wound == pytest.approx(tendon.spool_radius * angle, abs=2e-6)  # between 101 postures
    slack, hanging = postures.joints_at(-1.0), equilibrium(postures.mechanism, np.zeros(1))
    assert slack == pytest.approx(hanging), "a string that is let out further does not push"
    assert postures.bones(np.zeros(2))[-1][1] == pytest.approx([0.055, 0.0], abs=1e-9)


def test_three_fingers_move_together(explained: Path) -> None:
    """Measured, starting model and causes: as many pictures each, and the models differ."""
    found = motions(explained.read_text(encoding="utf-8"))
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


def test_the_fingers_fit_a_phone(explained: Path) -> None:
    """No sideways scrolling, nothing on the console, and all three beside each other."""
    browser = find_browser()
    if browser is None:
        pytest.skip("needs Chromium (Debian: apt-get install chromium)")
    views, console = look_at(browser, explained.parent, [explained.name], (1280, 400))
    assert console == []
    for view in views:
        assert view.needed <= view.width, view
        assert min(view.drawings) > 100.0, view


ROWS = 80


def recording(*, tendons: int = 1, force: bool = True) -> Recording:
    """A made-up second of a bench."""
    time = np.arange(ROWS) / 80.0
    theta = np.sin(2.0 * np.pi * time)[:, None].repeat(tendons, axis=1)
    columns = {"command": theta + 0.5, "force": 2.0 + theta if force else None}
    return recorded(time, theta, name="run_0.csv", bench="spring_weak", **columns)


def trajectory(measured: Recording) -> Trajectory:
    """A simulation that is a little off."""
    return Trajectory(
        time=measured.time,
        motor_position=0.9 * measured.motor_position,
        motor_velocity=0.9 * measured.motor_velocity,
        force=2.0 + 0.9 * measured.motor_position,
        joint_position=measured.motor_position[:, :1],
    )


def picture(path: Path, measured: Recording) -> np.ndarray:
    """Draw and read the pixels, shape (height, width, 4)."""
    from matplotlib.image import imread

    save(recording_figure(measured, trajectory(measured)), path)
    return imread(path)


def test_angle_force_and_residuals_are_drawn(tmp_path: Path) -> None:
    """A picture of several panels, none of it blank; without a load cell it is half as tall."""
    both = picture(tmp_path / "both.png", recording())
    angle = picture(tmp_path / "angle.png", recording(force=False))
    assert both.shape[1] == angle.shape[1]
    assert 1.5 < both.shape[0] / angle.shape[0] < 2.0
    for pixels in (both, angle):
        strips = np.array_split(pixels[..., :3], 4)
        assert all(float(np.mean(strip < 0.9)) > 0.005 for strip in strips)


def test_every_tendon_has_its_own_column(tmp_path: Path) -> None:
    """Two tendons make a picture twice as wide."""
    one = picture(tmp_path / "one.png", recording())
    two = picture(tmp_path / "two.png", recording(tendons=2))
    assert two.shape[1] == 2 * one.shape[1]


def test_the_name_of_a_recording_is_no_formula(tmp_path: Path) -> None:
    """Whatever a file is called stands above its picture as it is."""
    shown = picture(tmp_path / "named.png", replace(recording(), name=r"100%_{a}^$b$\frac{x$.csv"))
    assert shown.shape == picture(tmp_path / "plain.png", recording()).shape
