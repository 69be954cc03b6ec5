"""The README's figure: ``python docs/make_figures.py`` diagnoses the example and draws it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from tendon_newton.data.dataset import load_dataset
from tendon_newton.data.files.picture import new_figure, save, tidy
from tendon_newton.data.model_file import load_model
from tendon_newton.diagnosis.diagnose import diagnose
from tendon_newton.diagnosis.reporting.held_out import WINDOW, Window, compare, telling_windows

ROOT = Path(__file__).resolve().parents[1]
EXAMPLE = ROOT / "examples" / "hidden_friction"
PICTURE = ROOT / "docs" / "images" / "before_after.png"
INK, GREY, BEFORE, AFTER = "#2b2f36", "#8a8f98", "#d1603d", "#1f6f8b"
COLUMNS = (
    ("theta", "motor angle [rad]", 1e3, "residual [mrad]"),
    ("force", "tendon force [N]", 1.0, "residual [N]"),
)


def main() -> None:
    """Diagnose the example and draw the finger's most telling seconds."""
    _, evidence = diagnose(load_dataset(EXAMPLE), load_model(EXAMPLE / "model.toml"))
    windows = telling_windows(compare(evidence), gap=True)
    draw(next(w for w in windows if w.comparison.recording.bench == "finger"))


def draw(window: Window) -> None:
    """Draw measured and simulated signals over a window, and their residuals below."""
    figure = new_figure(10.5, 4.8)
    panels = figure.subplots(2, 2, sharex=True, height_ratios=[2, 1])
    for column, settings in enumerate(COLUMNS):
        draw_signal(panels[:, column], window, *settings)
    lines, names = panels[0, 0].get_legend_handles_labels()
    figure.legend(lines, names, frameon=False, loc="outside lower center", ncols=3)
    name = window.comparison.recording.name
    figure.suptitle(
        f"{name}: {WINDOW:g} s that no fit has seen (synthetic recording)", fontsize=11, color=INK
    )
    PICTURE.parent.mkdir(parents=True, exist_ok=True)
    save(figure, PICTURE, dpi=120)


def draw_signal(
    panels: Any, window: Window, signal: str, label: str, scale: float, residual: str
) -> None:
    """Draw one signal and its residual."""
    comparison, rows = window.comparison, window.rows
    time, measured = comparison.time[rows], comparison.measured(signal)[rows]
    pair = comparison.residual(signal)
    assert pair is not None
    before, after = (values[rows] for values in pair)
    panels[0].plot(time, measured, color=INK, alpha=0.45, linewidth=4, label="measured")
    for values, color, line, name in (
        (before, BEFORE, "--", "simulated, before"),
        (after, AFTER, "-", "simulated, after"),
    ):
        panels[0].plot(time, measured - values, line, color=color, label=name)
        panels[1].plot(time, scale * values, color=color, linewidth=1.2)
    panels[0].set_ylabel(label)
    panels[1].set_ylabel(residual)
    panels[1].set_xlabel("time [s]")
    for axes in panels:
        tidy(axes)
        axes.margins(x=0.0)


if __name__ == "__main__":
    main()
