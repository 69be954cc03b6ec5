"""``simulate``: one picture of what was measured and what the model makes of it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from tendon_newton.data.files.picture import new_figure, save, tidy
from tendon_newton.data.recording import Array, Recording
from tendon_newton.data.root_mean_square import rms
from tendon_newton.errors import InvalidOutput
from tendon_newton.simulation.hosts.rollout import Trajectory

INK, GREY, COMMAND, SIMULATED = "#2b2f36", "#8a8f98", "#b8860b", "#1f6f8b"


def plot_trajectory(path: Path, recording: Recording, trajectory: Trajectory) -> None:
    """Draw command, measured and simulated angle and tension, and their residuals, into a PNG file.

    Args:
        path: Where the picture goes.
        recording: What was measured.
        trajectory: What a model made of it, at the same rows.

    Raises:
        InvalidOutput: The file cannot be written.
    """
    if path.suffix.lower() != ".png":
        raise InvalidOutput(f"The picture is a PNG file; {path} ends otherwise.")
    tendons = recording.tendon_count
    rows = 2 if recording.force is None else 4
    figure = new_figure(10.5 * tendons, 1.2 + 2.0 * rows)
    panels = figure.subplots(
        rows, tendons, sharex=True, squeeze=False, height_ratios=[2, 1] * (rows // 2)
    )
    for d in range(tendons):
        plot_angle(panels[:2, d], recording, trajectory, d)
        if recording.force is not None:
            plot_force(panels[2:, d], recording.force[:, d], trajectory, d)
        panels[-1, d].set_xlabel("time [s]")
    for axes in panels.flat:
        tidy(axes)
        axes.margins(x=0.0)
    title = f"{recording.name}: {recording.bench}, measured and simulated"
    figure.suptitle(title, fontsize=13)
    save(figure, path)


def plot_angle(panels: Any, recording: Recording, trajectory: Trajectory, tendon: int) -> None:
    """Draw one motor's angle and its residual."""
    measured, simulated = recording.motor_position[:, tendon], trajectory.motor_position[:, tendon]
    if recording.command is not None:
        panels[0].step(
            recording.time,
            recording.command[:, tendon],
            where="post",
            color=COMMAND,
            linewidth=1.0,
            label="command",
        )
    plot_pair(panels, recording.time, measured, simulated)
    panels[0].set_ylabel("motor angle [rad]")
    panels[1].set_ylabel("residual [mrad]")
    plot_residual(panels[1], recording.time, 1.0e3 * (measured - simulated), "mrad")


def plot_force(panels: Any, measured: Array, trajectory: Trajectory, tendon: int) -> None:
    """Draw one tendon's tension and its residual."""
    simulated = trajectory.force[:, tendon]
    plot_pair(panels, trajectory.time, measured, simulated)
    panels[0].set_ylabel("tension [N]")
    panels[1].set_ylabel("residual [N]")
    plot_residual(panels[1], trajectory.time, measured - simulated, "N")


def plot_pair(panels: Any, time: Array, measured: Array, simulated: Array) -> None:
    """Draw what was measured under what was simulated."""
    panels[0].plot(time, measured, color=INK, linewidth=2.6, alpha=0.45, label="measured")
    panels[0].plot(time, simulated, color=SIMULATED, linewidth=1.3, label="simulated")
    panels[0].legend(frameon=False, loc="upper right", ncols=3)


def plot_residual(axes: Any, time: Array, residual: Array, unit: str) -> None:
    """Draw measured minus simulated with its root mean square."""
    axes.axhline(0.0, color=GREY, linewidth=0.8)
    axes.plot(time, residual, color=SIMULATED, linewidth=1.0)
    size = rms(residual)
    axes.set_title(f"measured − simulated, {size:.3g} {unit} RMS", loc="left", fontsize=9)
