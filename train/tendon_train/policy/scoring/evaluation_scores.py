"""Policies on the paper's stairs: what their climbs are worth, and how they look."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from tendon_newton.data.files.picture import COLOURS, INK, new_figure, save, tidy
from tendon_newton.data.recording import Array
from tendon_newton.data.root_mean_square import rms
from tendon_train.policy.scoring.policy_evaluation import Climb

SETTLED = 0.5  # Last part of a stair that counts as settled [s]


@dataclass(frozen=True, kw_only=True)
class StairScore:
    """Errors on one stair, in the nominal world."""

    goal: float  # Goal angle [rad]
    rising: bool  # Whether the finger closes towards it
    rmse: float  # Tip error over the whole stair, RMS [m]
    settled_error: float  # Mean tip error over its last half second [m]
    settled_angle: float  # Mean angle of the tip over its last half second [rad]
    reachable_error: float  # Least tip error at which the nominal finger can rest [m]


@dataclass(frozen=True, kw_only=True)
class ClimbScore:
    """Errors of one policy on all stairs."""

    policy: str
    place: str
    rmse: float  # Tip error over all rows of the nominal world, RMS [m]
    rising_rmse: float  # On the stairs up [m]
    falling_rmse: float  # On the stairs down [m]
    settled_error: float  # Mean tip error over the last half second of all stairs [m]
    overshoot: float  # Most that the tip went beyond a goal on the way to it [rad]
    least_motor_angle: float  # Least angle of the first motor [rad]; at home it is 0
    world_rmse: tuple[float, ...]  # Tip error of each further world, RMS [m]
    stairs: tuple[StairScore, ...]

    def to_json(self) -> dict[str, Any]:
        """Return the numbers by name; units as in the attributes."""
        return asdict(self)


def score(climb: Climb, reachable: Array) -> ClimbScore:
    """Measure a climb.

    Args:
        reachable: Least error at which the finger can rest at each row's goal [m], shape (T,).
    """
    error = climb.error[:, 0]
    pieces = stair_slices(climb.goal)
    rising = [
        place == 0 or bool(climb.goal[p.start] > climb.goal[p.start - 1])
        for place, p in enumerate(pieces)
    ]
    stairs = [stair(climb, p, up, reachable) for p, up in zip(pieces, rising, strict=True)]
    return ClimbScore(
        policy=climb.policy,
        place=climb.place,
        rmse=rms(error),
        rising_rmse=pooled(error, [p for p, up in zip(pieces, rising, strict=True) if up]),
        falling_rmse=pooled(error, [p for p, up in zip(pieces, rising, strict=True) if not up]),
        settled_error=float(np.mean([s.settled_error for s in stairs])),
        overshoot=max(overshoot(climb, p, up) for p, up in zip(pieces, rising, strict=True)),
        least_motor_angle=float(np.min(climb.motor_position[:, 0])),
        world_rmse=tuple(rms(climb.error[:, w]) for w in range(1, climb.error.shape[1])),
        stairs=tuple(stairs),
    )


def stair(climb: Climb, piece: slice, rising: bool, reachable: Array) -> StairScore:
    """Measure one stair."""
    error, time = climb.error[piece, 0], climb.time[piece]
    late = time > time[-1] - SETTLED
    return StairScore(
        goal=float(climb.goal[piece.start]),
        rising=rising,
        rmse=rms(error),
        settled_error=float(np.mean(error[late])),
        settled_angle=float(np.mean(climb.tip_angle[piece, 0][late])),
        reachable_error=float(reachable[piece.start]),
    )


def stair_slices(goal: Array) -> list[slice]:
    """Return the rows of each stair."""
    edges = [0, *(int(i) + 1 for i in np.flatnonzero(np.diff(goal))), len(goal)]
    return [slice(first, end) for first, end in pairwise(edges)]


def overshoot(climb: Climb, piece: slice, rising: bool) -> float:
    """Return how far the tip went beyond a stair's goal [rad], 0 where it did not."""
    beyond = climb.tip_angle[piece, 0] - climb.goal[piece]
    return float(max(0.0, np.max(beyond if rising else -beyond)))


def pooled(error: Array, pieces: Sequence[slice]) -> float:
    """Return the RMS over the rows of some stairs; not a number where there is none."""
    return rms(np.concatenate([error[p] for p in pieces])) if pieces else float("nan")


def to_markdown(scores: Sequence[ClimbScore]) -> str:
    """Return the tables of an evaluation."""
    lines = [
        "| policy | where | tip error, RMS [mm] | closing | opening | settled | overshoot [rad] "
        "| other worlds [mm] |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for s in scores:
        figures = (s.rmse, s.rising_rmse, s.falling_rmse, s.settled_error)
        shown = " | ".join(f"{1e3 * value:.2f}" for value in figures)
        lines.append(
            f"| {s.policy} | {s.place} | {shown} | {s.overshoot:.3f} | {spread(s.world_rmse)} |"
        )
    return "\n".join(lines) + "\n"


def spread(values: Sequence[float]) -> str:
    """Return median and worst of some errors, in mm."""
    if not values:
        return "-"
    return f"{1e3 * float(np.median(values)):.2f}, at worst {1e3 * max(values):.2f}"


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
