"""A proposed run as files: its command, where to record it, and what it is expected to show."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from tendon_newton.data.files.picture import new_figure, save, tidy
from tendon_newton.data.files.toml_file import write_toml
from tendon_newton.diagnosis.next_experiment.separation import Plan, Prediction
from tendon_newton.diagnosis.reporting.inline_svg import AFTER, FAINT, GREY, INK

SHOWN = 12
"""Runs in the picture, the best ones."""


def write_command(path: Path, plan: Plan) -> None:
    """Write the command as CSV: ``t`` [s] and ``theta_d`` [rad], held until the next row.

    Of several servos each has its column, ``theta_d_0`` and so on.
    """
    names = [f"theta_d_{d}" for d in range(plan.servos)] if plan.servos > 1 else ["theta_d"]
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(("t", *names))
        writer.writerows(
            (f"{t:.6f}", *(f"{c:.6f}" for c in row))
            for t, row in zip(plan.time, plan.commands, strict=True)
        )


def write_setting(path: Path, plan: Plan) -> None:
    """Write which command to record on which bench, as TOML."""
    write_toml(path, {"command": path.with_suffix(".csv").name, **setting_of(plan)})


def write_prediction(path: Path, predictions: Sequence[Prediction]) -> None:
    """Write bench, repeats and the predicted differences of every run that was tried, as TOML."""
    best = predictions[0]
    top: dict[str, Any] = {
        "command": path.with_suffix(".csv").name,
        **setting_of(best.plan),
        "repeats": best.repeats or 0,
        "left_open": [list(pair) for pair in best.open],
    }
    write_toml(path, top, runs=[run_of(p) for p in predictions])


def setting_of(plan: Plan) -> dict[str, Any]:
    """Return bench and its numbers as ``dataset.toml`` names them."""
    table = plan.setting.to_json()
    del table["seconds"]
    return table


def run_of(prediction: Prediction) -> dict[str, Any]:
    """Return what one run is expected to show."""
    like = prediction.hardest
    row: dict[str, Any] = {
        "bench": prediction.plan.place,
        "excitation": prediction.plan.excitation,
        "duration_s": prediction.plan.duration,
        "repeats": prediction.repeats or 0,
        "separation": round(like.separation, 4),
        "theta_mrad": round(1e3 * like.theta, 4),
        "pair": list(like.pair),
    }
    return row if like.force is None else {**row, "force_n": round(like.force, 5)}


def draw_prediction(path: Path, predictions: Sequence[Prediction]) -> None:
    """Draw the command of the best run, and how far each run keeps the causes apart.

    Raises:
        InvalidOutput: The file cannot be written.
    """
    figure = new_figure(9.0, 4.2)
    left, right = figure.subplots(1, 2, width_ratios=(1.0, 1.1))
    best, shown = predictions[0], predictions[:SHOWN]
    left.step(best.plan.time, best.plan.command, where="post", color=AFTER, linewidth=1.4)
    left.set_xlabel("time [s]")
    left.set_ylabel("commanded angle [rad]")
    left.set_title(
        f"{best.plan.excitation.replace('_', ' ')} on {best.plan.place}",
        loc="left",
        fontsize=10,
        color=INK,
    )
    for k, prediction in enumerate(shown):
        size = prediction.hardest.separation
        right.barh(k, size, color=AFTER if k == 0 else FAINT, height=0.7)
        right.annotate(
            verdict(prediction),
            (size, k),
            xytext=(3, 0),
            textcoords="offset points",
            va="center",
            fontsize=8,
        )
    labels = [f"{p.plan.place}, {p.plan.excitation.replace('_', ' ')}" for p in shown]
    right.set_yticks(range(len(shown)), labels, fontsize=8)
    right.invert_yaxis()
    right.margins(x=0.35)
    right.set_xlabel("RMS difference after refitting [noise floors]")
    causes = " or ".join(best.hardest.pair).replace("_", " ")
    right.set_title(causes, loc="left", fontsize=10, color=INK)
    for axes in (left, right):
        tidy(axes)
        axes.tick_params(colors=GREY, labelcolor=INK)
    save(figure, path, dpi=130)


def verdict(prediction: Prediction) -> str:
    """Say in two words whether a run is enough."""
    if prediction.repeats is None:
        return "not enough"
    return "once" if prediction.repeats == 1 else f"{prediction.repeats} times"
