"""A picture of joints that shake: spectrum, motion, and the loop with and without a change."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tendon_newton.data.files.picture import COLOURS, GREY, INK, new_figure, save, tidy
from tendon_newton.data.oscillations.causes import courses
from tendon_newton.data.oscillations.log_told import JointOfLog, change_text
from tendon_newton.data.oscillations.shaking import spectrum
from tendon_newton.data.oscillations.told_loop import ToldJoint
from tendon_newton.errors import InvalidParameter

DEGREE = np.pi / 180.0


def draw_loops(joints: Sequence[JointOfLog], path: Path) -> None:
    """Draw a row of three panels for each joint that shakes.

    Raises:
        InvalidParameter: No joint shakes, or the file's name has another ending.
        InvalidOutput: The file cannot be written.
    """
    if path.suffix not in (".png", ".svg", ".pdf"):
        raise InvalidParameter(f"{path}: a picture ends in .png, .svg or .pdf")
    if not joints:
        raise InvalidParameter(f"{path}: no joint shakes; there is nothing to draw")
    figure = new_figure(13.5, 0.6 + 3.2 * len(joints))
    panels = figure.subplots(len(joints), 3, squeeze=False)
    for row, seen in zip(panels, joints, strict=True):
        assert seen.told is not None
        draw_spectrum(row[0], seen.joint, seen.told)
        draw_motion(row[1], seen.recording, seen.told)
        draw_change(row[2], seen.told)
        for axes in row:
            tidy(axes)
    save(figure, path)


def draw_spectrum(axes: Any, joint: str, told: ToldJoint) -> None:
    """Draw the spectrum of an angle's changes, its floor and the line."""
    assert told.shaking is not None
    power, floor = spectrum(told.log.angle, told.log.step)
    pace = np.arange(len(power)) / (len(told.log.angle) * told.log.step)
    axes.semilogy(pace[1:], power[1:], color=COLOURS[0], linewidth=0.9, label="angle's changes")
    axes.semilogy(pace[1:], floor[1:], color=GREY, linewidth=1.2, label="local floor")
    axes.yaxis.set_major_formatter("{x:.0e}")
    axes.axvline(told.shaking.frequency, color=COLOURS[1], linewidth=1.0)
    axes.set_title(f"{joint}: {told.shaking.frequency:.2f} Hz", loc="left", fontsize=10)
    axes.set_xlabel("frequency [Hz]")
    axes.set_ylabel("power [rad²/s²]")
    axes.legend(frameon=False, fontsize=8)


def draw_motion(axes: Any, recording: str, told: ToldJoint) -> None:
    """Draw ten periods of command and angle."""
    assert told.shaking is not None
    last = told.shaking.last
    rows = slice(max(0, last - round(10.0 / (told.shaking.frequency * told.log.step))), last)
    time = told.log.step * np.arange(len(told.log.angle))[rows]
    axes.step(
        time,
        told.log.command[rows] / DEGREE,
        where="post",
        color=COLOURS[3],
        linewidth=1.0,
        label="command",
    )
    axes.plot(time, told.log.angle[rows] / DEGREE, color=INK, linewidth=1.4, label="measured")
    axes.set_title(recording, loc="left", fontsize=10)
    axes.set_xlabel("time [s]")
    axes.set_ylabel("angle [deg]")
    axes.legend(frameon=False, fontsize=8)


def draw_change(axes: Any, told: ToldJoint) -> None:
    """Draw the identified loop as it is, and after the change that is proposed first."""
    assert told.loop is not None
    assert told.explained is not None
    changes = told.explained.changes[:1]
    time, angles = courses(told.loop, changes)
    axes.plot(time, angles[:, 0] / DEGREE, color=COLOURS[1], linewidth=1.0, label="as it is")
    for change in changes:
        words = change_text(told.loop, change)
        axes.plot(time, angles[:, 1] / DEGREE, color=COLOURS[2], linewidth=1.4, label=words)
    axes.set_title(
        f"identified loop; cause: {told.explained.cause or 'not told'}", loc="left", fontsize=10
    )
    axes.set_xlabel("time [s]")
    axes.set_ylabel("angle off its goal [deg]")
    axes.legend(frameon=True, fontsize=8, loc="upper right")
