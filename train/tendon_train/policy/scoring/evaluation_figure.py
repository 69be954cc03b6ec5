"""The figure of an evaluation, after the paper's figure of the tracked stairs."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tendon_newton.data.files.picture import COLOURS, INK, new_figure, save, tidy
from tendon_train.policy.scoring.evaluation_scores import ClimbScore
from tendon_train.policy.scoring.policy_evaluation import Climb


def draw_climbs(climbs: Sequence[Climb], scores: Sequence[ClimbScore], path: Path) -> Path:
    """Draw angle and error of the tip, and motor and command, of every policy over time."""
    figure = new_figure(10.0, 8.0)
    angle, error, motor = figure.subplots(3, 1, sharex=True, height_ratios=[2, 1, 1.4])
    first = climbs[0]
    angle.step(
        first.time, first.goal, where="post", color=INK, linewidth=2.2, alpha=0.5, label="goal"
    )
    for place, (climb, score) in enumerate(zip(climbs, scores, strict=True)):
        colour = COLOURS[place % len(COLOURS)]
        draw_worlds(angle, climb, climb.tip_angle, colour)
        label = f"{climb.policy} ({climb.place}): {1e3 * score.rmse:.1f} mm RMS"
        angle.plot(climb.time, climb.tip_angle[:, 0], color=colour, linewidth=1.5, label=label)
        error.plot(climb.time, 1e3 * climb.error[:, 0], color=colour, linewidth=1.2)
        motor.plot(climb.time, climb.motor_position[:, 0], color=colour, linewidth=1.5)
        motor.step(climb.time, climb.command[:, 0], "--", where="post", color=colour, linewidth=0.8)
    angle.set_ylabel("angle of the tip, alpha [rad]")
    error.set_ylabel("tip error [mm]")
    error.set_ylim(bottom=0.0)
    motor.set_ylabel("motor (line)\nand command (dashed) [rad]")
    motor.set_xlabel("time [s]")
    angle.legend(frameon=False, fontsize=8, loc="upper left")
    angle.set_ylim(top=float(np.max(first.goal)) * 1.15 + 0.1 * len(climbs))
    for axes in (angle, error, motor):
        tidy(axes)
        axes.margins(x=0.0)
    save(figure, path)
    return path


def draw_worlds(axes: Any, climb: Climb, values: Any, colour: str) -> None:
    """Draw where nine in ten of the further worlds are."""
    if values.shape[1] > 2:
        low, high = np.quantile(values[:, 1:], (0.05, 0.95), axis=1)
        axes.fill_between(climb.time, low, high, color=colour, alpha=0.15, linewidth=0.0)
