"""The picture beside a simulated recording shows what there is, and nothing needs a display."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tendon_newton.data.files.picture import save
from tendon_newton.data.recording import Recording
from tendon_newton.data.recording_plot import recording_figure
from tendon_newton.errors import InvalidOutput
from tendon_newton.simulation.hosts.rollout import Trajectory

ROWS = 80


def recording(*, tendons: int = 1, force: bool = True) -> Recording:
    """A made-up second of a bench."""
    time = np.arange(ROWS) / 80.0
    theta = np.sin(2.0 * np.pi * time)[:, None].repeat(tendons, axis=1)
    return Recording(
        name="run_0.csv",
        bench="spring_weak",
        time=time,
        command=theta + 0.5,
        motor_position=theta,
        motor_velocity=np.gradient(theta, time, axis=0),
        force=2.0 + theta if force else None,
    )


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


@pytest.mark.parametrize("name", [r"a$\frac{x$.csv", "a$b$.csv", "100%_{a}^.csv"])
def test_the_name_of_a_recording_is_no_formula(name: str, tmp_path: Path) -> None:
    """Whatever a file is called stands above its picture as it is."""
    shown = picture(tmp_path / "named.png", replace(recording(), name=name))
    assert shown.shape == picture(tmp_path / "plain.png", recording()).shape


def test_a_picture_that_cannot_be_written_is_an_error(tmp_path: Path) -> None:
    """The message says what is wrong with the path."""
    with pytest.raises(InvalidOutput, match="the picture cannot be written"):
        save(
            recording_figure(recording(), trajectory(recording())),
            tmp_path / "no_such_folder" / "picture.png",
        )
