"""The picture of docs/real_data.md, ``python -m tests.results.so101_figure LOGS``."""

import argparse
from pathlib import Path
from typing import Any

import numpy as np

from tendon_newton.identification.study import Study
from tendon_newton.importers.so101 import read_so101
from tendon_newton.lint_checks import blocked_rows
from tendon_newton.model_file import Model, NamedValues
from tendon_newton.recording import Recording

PICTURE = Path(__file__).resolve().parents[2] / "docs" / "images" / "so101.png"
INK, GREY, BEFORE, AFTER = "#2b2f36", "#8a8f98", "#d1603d", "#1f6f8b"
FOUND = {
    "actuator_lag": {"time_constant": 0.0478},
    "command_delay": {"delay": 0.0372},
    "deadband": {"width": 0.0079},
}
"""What the diagnosis of Rotation finds (`tests.results.so101`)."""


def main() -> None:
    """Draw a step that no fit has seen, and the stop of the wrist."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("logs", type=Path)
    logs = {log.recording.name: log.recording for log in read_so101(parser.parse_args().logs).logs}
    figure = Figure(figsize=(10.5, 4.4), layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(1, 2)
    draw_servo(panels[0], logs["Rotation_random_waypoints.csv"])
    draw_stop(panels[1], logs["Wrist_Roll_single_joint_wrist_roll.csv"])
    for axes in panels:
        axes.set_xlabel("time [s]")
        axes.set_ylabel("angle [rad]")
        axes.grid(color="#e4e6ea", linewidth=0.8)
        axes.set_axisbelow(True)
        axes.spines[["top", "right"]].set_visible(False)
        axes.legend(frameon=False, loc="upper left")
    PICTURE.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(PICTURE, dpi=120)


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
    axes.plot(time, recording.motor_position[rows, 0], color=INK, alpha=0.45, linewidth=4,
              label="measured")  # fmt: skip
    axes.plot(time, simulated.motor_position[rows, 0], color=AFTER, label="delay, lag and deadband")
    axes.set_title("Rotation, random waypoints: no fit has seen them", fontsize=10)


def draw_stop(axes: Any, recording: Recording) -> None:
    """Draw the motion in which something solid is in the wrist's way."""
    assert recording.command is not None
    theta, goal = recording.motor_position[:, 0], recording.command[:, 0]
    blocked = blocked_rows(theta, goal, -1.0)
    axes.plot(recording.time, goal, color=BEFORE, label="told")
    axes.plot(recording.time, theta, color=INK, alpha=0.6, linewidth=2.5, label="measured")
    axes.plot(recording.time[blocked], theta[blocked], ".", color=AFTER, markersize=4,
              label="blocked: not compared")  # fmt: skip
    axes.set_title("Wrist_Roll goes no further than -1.03 rad", fontsize=10)


if __name__ == "__main__":
    main()
