"""The sim-to-real experiment: one sinusoid on the bench and in simulation, and the tips' distance.

The paper's sinusoid has an amplitude of pi/2 at 0.5 Hz; its centre is not said. About pi/2 no
command is negative, but by its data sheet the motor hardly follows at the paper's duty; about
0.2 rad the ideal source opens the finger fully, which is what the paper shows.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from train.actuator.figures import GREY, INK, new_figure, save, tidy
from train.reproduction.closed_loop import SETTLED, Replayed, replayed
from train.reproduction.outcome import Figure, Outcome, Row, mean_interval, row
from train.reproduction.reproduction import BEST, IDEALS, MODELS, Reproduction
from train.reproduction.unit import Unit

SINES = {"open_sine": "about 0.2 rad", "closing_sine": "about pi/2"}
"""Kind of the recording and its centre in words; the first is the one that is compared."""
PAPER_TIP = {"ideal": 14.58, "network": 8.61}
"""[mm]"""
PAPER_REDUCTION = 41.0  # [%]
COLOURS = {
    "ideal": "#d1495b", "ideal_refitted": "#e8a0a8", "network": "#1764ab", "physical": "#2f8f5b",
    "hybrid": "#e08e1a",
}  # fmt: skip
SHOWN = 8.0
"""Time that a figure shows [s]."""

Errors = dict[str, dict[str, list[float]]]
"""Kind -> model -> tip error of each bench [mm]."""


def run(reproduction: Reproduction) -> Outcome:
    """Replay both sinusoids with every model on every bench."""
    errors: Errors = {kind: {model: [] for model in MODELS} for kind in SINES}
    shown: dict[str, Replayed] = {}
    for unit in reproduction.units:
        reproduction.tell(f"  {unit.name}")
        for model in MODELS:
            for kind, found in zip(SINES, of_model(reproduction, unit, model), strict=True):
                errors[kind][model].append(1.0e3 * found.tip_error)
                if unit is reproduction.units[0] and kind == next(iter(SINES)):
                    shown[model] = found
    draw(shown, reproduction)
    return Outcome(
        rows=tuple(r for kind in SINES for r in rows_of(kind, errors[kind])),
        numbers={"tip_error_mm": errors, "benches": [unit.name for unit in reproduction.units]},
        figures=(
            Figure(
                file="tip_sine.png",
                caption=f"Tip during a sinusoid of pi/2 at 0.5 Hz about 0.2 rad, "
                f"{reproduction.units[0].name}. {reproduction.caption}",
            ),
        ),
        text=reduction_text(errors),
    )


def of_model(reproduction: Reproduction, unit: Unit, model: str) -> list[Replayed]:
    """Replay the sinusoids of a bench with one of its models."""
    return replayed(
        [unit.find("finger", kind) for kind in SINES],
        reproduction.model(unit, model),
        time_step=reproduction.settings.time_step,
    )


def rows_of(kind: str, errors: Mapping[str, list[float]]) -> list[Row]:
    """Return the rows of one sinusoid."""
    where = f"tip, sinusoid {SINES[kind]}"
    compared = kind == next(iter(SINES))
    rows = [
        row(where, f"{words}, RMSE", "mm", errors[model],
            paper=PAPER_TIP.get(model) if compared else None)
        for model, words in MODELS.items()
    ]  # fmt: skip
    rows += [
        row(where, f"{MODELS[model]}: less than the better ideal source by", "%",
            reductions(errors, model),
            paper=PAPER_REDUCTION if compared and model == "network" else None)
        for model in BEST
    ]  # fmt: skip
    return rows


def reductions(errors: Mapping[str, list[float]], model: str) -> list[float]:
    """Return by how much a model's error is below that of the better ideal source, by bench [%]."""
    better = np.min([errors[ideal] for ideal in IDEALS], axis=0)
    return (100.0 * (1.0 - np.asarray(errors[model]) / better)).tolist()


def reduction_text(errors: Errors) -> str:
    """Return the reductions with intervals over the benches."""
    lines = [
        "Tip error below that of the better ideal source of the same bench: mean over the benches "
        "and 95 % interval of that mean (Student's t).",
        "",
        f"| sinusoid | {' | '.join(MODELS[model] for model in BEST)} |",
        f"|---{'|---' * len(BEST)}|",
    ]
    for kind, words in SINES.items():
        cells = []
        for model in BEST:
            mean, low, high = mean_interval(reductions(errors[kind], model))
            spread = "" if np.isnan(low) else f" ({low:.0f} to {high:.0f})"
            cells.append(f"{mean:.0f} %{spread}")
        lines.append(f"| {words} | {' | '.join(cells)} |")
    return "\n".join(lines)


def draw(shown: Mapping[str, Replayed], reproduction: Reproduction) -> None:
    """Draw height of the tip, motor angle and tension of every model and of the bench."""
    figure: Any = new_figure(9.0, 8.0)
    tip, angle, force = figure.subplots(3, 1, sharex=True, height_ratios=[1.4, 1, 1])
    bench = next(iter(shown.values())).recording
    time = bench.time - bench.time[0]
    part = (time >= SETTLED) & (time < SETTLED + SHOWN)
    assert bench.command is not None
    angle.step(time[part], bench.command[part, 0], where="post", color=GREY, label="commanded")
    for name, recording, colour in (
        ("bench", bench, INK), *((MODELS[m], s.simulated, COLOURS[m]) for m, s in shown.items()),
    ):  # fmt: skip
        assert recording.tip is not None
        assert recording.force is not None
        style = {"color": colour, "linewidth": 2.4 if colour == INK else 1.1}
        tip.plot(time[part], 1.0e3 * recording.tip[part, 1], label=name, **style)
        angle.plot(time[part], recording.motor_position[part, 0], **style)
        force.plot(time[part], recording.force[part, 0], **style)
    for axes, label in ((tip, "tip z [mm]"), (angle, "angle [rad]"), (force, "tension [N]")):
        axes.set_ylabel(label)
        tidy(axes)
    tip.legend(frameon=False, fontsize=8, ncols=3)
    angle.legend(frameon=False, fontsize=8)
    force.set_xlabel("time [s]")
    save(figure, reproduction.folder("figures") / "tip_sine.png")
