"""Scores of a climb: errors of the tip, in all and stair by stair."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from itertools import pairwise
from typing import Any

import numpy as np

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
