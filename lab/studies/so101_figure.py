"""Pictures of docs/lab/so101.md, ``python -m lab.studies.so101_figure LOGS``."""

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from tendon_lab.foreign_logs.so101 import read_so101
from tendon_newton.data.checks.lint_checks import blocked_rows
from tendon_newton.data.files.picture import new_figure, save, tidy
from tendon_newton.data.model_file import Model, NamedValues
from tendon_newton.data.recording import Array, Recording
from tendon_newton.identification.study import Study

IMAGES = Path(__file__).resolve().parents[2] / "docs" / "images"
INK, GREY, BEFORE, AFTER = "#2b2f36", "#8a8f98", "#d1603d", "#1f6f8b"
JOINTS = {
    "Rotation": INK,
    "Pitch": BEFORE,
    "Elbow": AFTER,
    "Wrist_Pitch": "#8a6fae",
    "Wrist_Roll": "#c39b2f",
    "Jaw": "#4c9f70",
}
JUMP = (111.2, 113.6)  # Part of the sweep that is drawn [s]
JAW_SCALE = 2.336
"""Turn of the Jaw's shaft per angle logged [1]: a count over the spacing of its angles."""
WINDOW = 1.2  # Time over which the sweep is taken for a sine [s]
WINDOWS = np.arange(70.0, 119.5, 0.75)
FREQUENCIES = np.linspace(0.4, 4.2, 191)  # [Hz]
FOUND = {
    "actuator_lag": {"time_constant": 0.0478},
    "command_delay": {"delay": 0.0372},
    "deadband": {"width": 0.0079},
}
"""What the diagnosis of Rotation finds (`lab.studies.so101`)."""


def main() -> None:
    """Draw a step that no fit has seen, the stop of the wrist, and the jump of the sweep."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("logs", type=Path)
    logs = {log.recording.name: log.recording for log in read_so101(parser.parse_args().logs).logs}
    IMAGES.mkdir(parents=True, exist_ok=True)
    figure, (left, right) = panels()
    draw_servo(left, logs["Rotation_random_waypoints.csv"])
    draw_stop(right, logs["Wrist_Roll_single_joint_wrist_roll.csv"])
    for axes in (left, right):
        dress(axes, "time [s]", "angle [rad]")
    save(figure, IMAGES / "so101.png", dpi=120)
    figure, (left, right) = panels()
    draw_sweep(left, logs["Rotation_chirp_sweep.csv"])
    dress(left, "time [s]", "angle [rad]")
    draw_lags(right, logs)
    dress(right, "acceleration that the shaft is told [rad/s²]", "lag [ms]")
    save(figure, IMAGES / "so101_sweep.png", dpi=120)


def panels() -> tuple[Any, Any]:
    """Return a figure with two panels side by side."""
    figure = new_figure(10.5, 4.0)
    return figure, figure.subplots(1, 2)


def dress(axes: Any, x: str, y: str) -> None:
    """Label a panel in the style of the documentation."""
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    tidy(axes)
    axes.legend(frameon=False, loc="upper left", fontsize=9)


def draw_servo(axes: Any, recording: Recording) -> None:
    """Draw some seconds of a motion beside what the diagnosed servo makes of its commands."""
    assert recording.command is not None
    effects = tuple(NamedValues(name=name, values=values) for name, values in FOUND.items())
    model = Model(actuator=NamedValues(name="ideal_position", values={}), effects=effects)
    (simulated,) = Study([recording], model, tuple(FOUND)).trajectories({})
    change = np.abs(np.diff(recording.command[:, 0]))
    start = recording.time[int(np.argmax(np.convolve(change, np.ones(150), mode="valid")))]
    rows = (recording.time >= start) & (recording.time <= start + 3.0)
    time = recording.time[rows]
    axes.step(time, recording.command[rows, 0], where="post", color=BEFORE, label="told = assumed")
    axes.plot(
        time,
        recording.motor_position[rows, 0],
        color=INK,
        alpha=0.45,
        linewidth=4,
        label="measured",
    )
    axes.plot(time, simulated.motor_position[rows, 0], color=AFTER, label="delay, lag and deadband")
    axes.set_title("Rotation, random waypoints: no fit has seen them", fontsize=10)


def draw_sweep(axes: Any, recording: Recording) -> None:
    """Draw the two seconds in which a joint falls behind."""
    assert recording.command is not None
    time = recording.time - recording.time[0]
    rows = (time > JUMP[0]) & (time < JUMP[1])
    axes.step(time[rows], recording.command[rows, 0], where="post", color=BEFORE, label="told")
    axes.plot(time[rows], recording.motor_position[rows, 0], color=INK, label="measured")
    axes.set_ylim(-0.16, 0.2)
    axes.set_title("Rotation, sweep of frequencies at 3 Hz", fontsize=10)


def draw_lags(axes: Any, logs: Mapping[str, Recording]) -> None:
    """Draw by how much each joint lags behind the sweep as its acceleration grows."""
    for joint, color in JOINTS.items():
        scale = JAW_SCALE if joint == "Jaw" else 1.0
        points = [response(logs[f"{joint}_chirp_sweep.csv"], at) for at in WINDOWS]
        axes.plot(
            [scale * asked for asked, _ in points],
            [1.0e3 * lag for _, lag in points],
            ".-",
            color=color,
            linewidth=1.0,
            label=joint,
        )
    axes.set_title("six joints fall behind at the same acceleration", fontsize=10)


def response(recording: Recording, at: float) -> tuple[float, float]:
    """Return the acceleration told [rad/s^2] and the lag [s] of a sweep's answer.

    Args:
        recording: The sweep.
        at: Middle of the window in which both are taken for sines of one frequency [s].
    """
    assert recording.command is not None
    time = recording.time - recording.time[0] - at
    rows = np.abs(time) < WINDOW / 2
    time, goal, theta = time[rows], recording.command[rows, 0], recording.motor_position[rows, 0]
    fits = [sine(time, goal, frequency) for frequency in FREQUENCIES]
    place = int(np.argmin([left for _, left in fits]))
    frequency, told = FREQUENCIES[place], fits[place][0]
    turned = np.angle(told / sine(time, theta, frequency)[0]) % (2.0 * np.pi)
    return abs(told) * (2.0 * np.pi * frequency) ** 2, turned / (2.0 * np.pi * frequency)


def sine(time: Array, values: Array, frequency: float) -> tuple[complex, float]:
    """Return amplitude and phase of a sine of some frequency [Hz] in values, and what is left."""
    phase = 2.0 * np.pi * frequency * time
    columns = np.stack([np.cos(phase), -np.sin(phase), np.ones_like(time)], axis=1)
    found = np.linalg.lstsq(columns, values, rcond=None)[0]
    return complex(found[0], found[1]), float(np.sum((values - columns @ found) ** 2))


def draw_stop(axes: Any, recording: Recording) -> None:
    """Draw the motion in which something solid is in the wrist's way."""
    assert recording.command is not None
    theta, goal = recording.motor_position[:, 0], recording.command[:, 0]
    blocked = blocked_rows(theta, goal, -1.0)
    axes.plot(recording.time, goal, color=BEFORE, label="told")
    axes.plot(recording.time, theta, color=INK, alpha=0.6, linewidth=2.5, label="measured")
    axes.plot(
        recording.time[blocked],
        theta[blocked],
        ".",
        color=AFTER,
        markersize=4,
        label="blocked: not compared",
    )
    axes.set_title("Wrist_Roll goes no further than -1.03 rad", fontsize=10)


if __name__ == "__main__":
    main()
