"""Pictures of recordings: what was measured, and what a model makes of it."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from tendon_newton.data.files.picture import new_figure, tidy
from tendon_newton.data.root_mean_square import rms

if TYPE_CHECKING:
    from matplotlib.figure import Figure

INK, GREY, COMMAND, SIMULATED = "#2b2f36", "#8a8f98", "#b8860b", "#1f6f8b"
COLUMNS = 3  # Panels side by side in a picture of many recordings
SIGNALS = {
    "motor_position": ("motor angle [rad]", "mrad", 1.0e3),
    "force": ("tension [N]", "N", 1.0),
}
"""Signal -> label, unit of its residual, and by what to multiply for that."""
Array = NDArray[np.float64]


class Curves(Protocol):
    """What is drawn of a recording or of its simulation."""

    @property
    def time(self) -> Array:
        """Instants [s], shape (T,)."""
        ...

    @property
    def motor_position(self) -> Array:
        """Motor angles [rad], shape (T, D)."""
        ...

    @property
    def force(self) -> Array | None:
        """Tensions [N], shape (T, D); None without a load cell."""
        ...


class Measured(Curves, Protocol):
    """What is drawn of a recording alone."""

    @property
    def name(self) -> str:
        """File name."""
        ...

    @property
    def bench(self) -> str:
        """Name of the bench."""
        ...

    @property
    def command(self) -> Array | None:
        """Commanded angles [rad], shape (T, D); None without."""
        ...


def recording_figure(recording: Measured, simulated: Curves | None = None) -> Figure:
    """Draw command, angle and tension of every tendon, and what a simulation of the rows misses."""
    tendons = recording.motor_position.shape[1]
    signals = 1 if recording.force is None else 2
    heights = [2] if simulated is None else [2, 1]
    figure = new_figure(10.5 * tendons, 1.2 + 2.0 * signals * len(heights))
    panels = figure.subplots(
        signals * len(heights), tendons, sharex=True, squeeze=False, height_ratios=heights * signals
    )
    for d in range(tendons):
        own = panels[:, d].reshape(signals, -1)
        plot_signal(own[0], recording, simulated, "motor_position", d)
        if recording.force is not None:
            plot_signal(own[1], recording, simulated, "force", d)
        panels[-1, d].set_xlabel("time [s]")
    for axes in panels.flat:
        tidy(axes)
        axes.margins(x=0.0)
    words = "measured" if simulated is None else "measured and simulated"
    figure.suptitle(f"{recording.name}: {recording.bench}, {words}", fontsize=13)
    return figure


def overview_figure(recordings: Sequence[Measured]) -> Figure:
    """Draw command and angle of many recordings, a panel each."""
    rows = ceil(len(recordings) / COLUMNS)
    figure = new_figure(4.0 * COLUMNS, 0.4 + 1.8 * rows)
    panels = list(figure.subplots(rows, COLUMNS, squeeze=False).flat)
    for axes, recording in zip(panels, recordings, strict=False):
        for d in range(recording.motor_position.shape[1]):
            plot_signal([axes], recording, None, "motor_position", d)
        axes.set_title(recording.name, fontsize=9)
        tidy(axes)
    for axes in panels[len(recordings) :]:
        axes.set_visible(False)
    return figure


def plot_signal(
    panels: Any, recording: Measured, simulated: Curves | None, signal: str, tendon: int
) -> None:
    """Draw ``motor_position`` or ``force`` of a tendon and, of a simulation, its residual."""
    label, unit, factor = SIGNALS[signal]
    time, measured = recording.time, getattr(recording, signal)[:, tendon]
    if signal == "motor_position" and recording.command is not None:
        command = recording.command[:, tendon]
        panels[0].step(time, command, where="post", color=COMMAND, linewidth=1.0, label="command")
    panels[0].plot(time, measured, color=INK, linewidth=2.6, alpha=0.45, label="measured")
    panels[0].set_ylabel(label)
    if simulated is not None:
        made = getattr(simulated, signal)[:, tendon]
        panels[0].plot(time, made, color=SIMULATED, linewidth=1.3, label="simulated")
        panels[1].set_ylabel(f"residual [{unit}]")
        plot_residual(panels[1], time, factor * (measured - made), unit)
    panels[0].legend(frameon=False, loc="upper right", ncols=3)


def plot_residual(axes: Any, time: Array, residual: Array, unit: str) -> None:
    """Draw measured minus simulated with its root mean square."""
    axes.axhline(0.0, color=GREY, linewidth=0.8)
    axes.plot(time, residual, color=SIMULATED, linewidth=1.0)
    size = rms(residual)
    axes.set_title(f"measured − simulated, {size:.3g} {unit} RMS", loc="left", fontsize=9)
