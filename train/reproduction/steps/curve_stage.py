"""Which model wins with how much data: the physical one, the network, or both."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from train.actuator.scoring.figures import new_figure, save, tidy
from train.reproduction.closed_loop import Replayed
from train.reproduction.outcome import Figure, Outcome, row
from train.reproduction.parts import MINUTES, learned_from, part_names, replays
from train.reproduction.reproduction import BEST, MODELS, Reproduction
from train.reproduction.steps.tip_stage import COLOURS, SINES

Curve = dict[str, dict[str, list[float]]]
"""Measure -> model -> value at each number of minutes."""
TIP, STEPS = "tip_mm", "steps_n"


def run(reproduction: Reproduction) -> Outcome:
    """Let every model learn from the first minutes of the first bench's recordings."""
    unit, minutes = reproduction.units[0], reproduction.settings.curve_minutes
    total = sum(r.duration for r in (*unit.dataset.train, *unit.dataset.test)) / 60.0
    curve: Curve = {what: {model: [] for model in BEST} for what in (TIP, STEPS)}
    for found in reproduction.each(errors_after, minutes):
        for model, errors in found.items():
            for what in curve:
                curve[what][model].append(errors[what])
    draw(curve, reproduction, minutes)
    winners = [min(BEST, key=lambda m, k=k: curve[TIP][m][k]) for k in range(len(minutes))]
    return Outcome(
        rows=tuple(
            row(
                f"{point:g} of {total:.0f} min of data",
                f"{MODELS[model]}, tip RMSE",
                "mm",
                [curve[TIP][model][place]],
                over="bench",
            )
            for place, point in enumerate(minutes)
            for model in BEST
        ),
        numbers={"minutes": list(minutes), **curve},
        figures=(
            Figure(
                file="data_curve.png",
                caption=f"Closed-loop errors over minutes of data, {unit.name}; the causes of the "
                f"physical model are those of the whole data's diagnosis. {reproduction.caption}",
            ),
        ),
        text=curve_text(curve, minutes, winners),
    )


def errors_after(reproduction: Reproduction, point: float) -> dict[str, dict[str, float]]:
    """Return the errors by model and measure after some minutes of recordings."""
    unit, part = reproduction.units[0], f"{point:g}{MINUTES}"
    if part in part_names(reproduction):
        models = learned_from(reproduction, part)
    else:
        models = {name: reproduction.model(unit, name) for name in BEST}
    recordings = [unit.find("finger", next(iter(SINES))), *unit.steps()]
    found = {name: replays(reproduction, recordings, model) for name, model in models.items()}
    return {
        name: {TIP: 1.0e3 * tip.tip_error, STEPS: mean_force_error(steps)}
        for name, (tip, *steps) in found.items()
    }


def mean_force_error(found: list[Replayed]) -> float:
    """Return the mean error of the tension [N]."""
    return float(np.mean([each.force_error for each in found]))


def curve_text(curve: Curve, minutes: tuple[float, ...], winners: list[str]) -> str:
    """Return the curve as a table."""
    lines = [
        "| minutes | "
        + " | ".join(f"{MODELS[m]}: tip [mm], steps [N]" for m in BEST)
        + " | nearest tip |",
        "|---" * (len(BEST) + 2) + "|",
    ]
    for place, point in enumerate(minutes):
        cells = [f"{curve[TIP][m][place]:.1f}, {curve[STEPS][m][place]:.2f}" for m in BEST]
        lines.append(f"| {point:g} | {' | '.join(cells)} | {MODELS[winners[place]]} |")
    return "\n".join(lines)


def draw(
    curve: Mapping[str, Mapping[str, list[float]]],
    reproduction: Reproduction,
    minutes: tuple[float, ...],
) -> None:
    """Draw both errors over the minutes."""
    figure: Any = new_figure(9.0, 3.6)
    panels = figure.subplots(1, 2)
    for axes, what, label in zip(
        panels, (TIP, STEPS), ("tip error, RMS [mm]", "force on the steps, RMS [N]"), strict=True
    ):
        for model in BEST:
            axes.plot(minutes, curve[what][model], "o-", color=COLOURS[model], label=MODELS[model])
        axes.set_xscale("log")
        axes.set_xticks(minutes, [f"{point:g}" for point in minutes])
        axes.minorticks_off()
        axes.set_ylim(bottom=0.0)
        axes.set_xlabel("recordings [min]")
        axes.set_ylabel(label)
        tidy(axes)
    panels[0].legend(frameon=False, fontsize=8)
    save(figure, reproduction.folder("figures") / "data_curve.png")
