"""How well a hand turns a ball: the same figures for a training's worlds and a deployment's log."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tendon_newton.data.cards.turning_task import TurningTask, half_turn
from tendon_newton.data.recording import Array

MINUTE = 60.0  # [s]


@dataclass(frozen=True, kw_only=True)
class TurningFigures:
    """What W balls did in the same time."""

    seconds: float  # Time that each was watched [s]
    turned: Array  # Net turn of each about the axis while in the cup [rad], shape (W,)
    drops: NDArray[np.int64]  # Times that each left the cup, shape (W,)
    tension: Array  # Largest tension of each hand's tendons [N], shape (W,)

    @property
    def turned_per_minute(self) -> float:
        """Mean net turn [rad/min]."""
        return float(np.mean(self.turned)) * MINUTE / self.seconds

    @property
    def drops_per_minute(self) -> float:
        """Mean number of drops [1/min]."""
        return float(np.mean(self.drops)) * MINUTE / self.seconds

    @property
    def largest_tension(self) -> float:
        """Largest tension of all tendons [N]."""
        return float(np.max(self.tension))

    @property
    def text(self) -> str:
        """The figures as a line."""
        return (
            f"{self.turned_per_minute:.1f} rad/min, {self.drops_per_minute:.2f} drops/min, "
            f"at most {self.largest_tension:.1f} N"
        )


def turning_figures(
    task: TurningTask, *, period: float, pose: Array, start: Array, tension: Array
) -> TurningFigures:
    """Measure what balls did.

    A turn counts between two rows in which the ball is in its cup; so nothing counts while a ball
    is put back. A drop is a row out of the cup behind one in it.

    Args:
        period: Time from row to row [s].
        pose: Places [m] and quaternions (x, y, z, w) of the balls, shape (T, W, 7).
        start: Where they start [m], shape (3,) or (W, 3).
        tension: Tensions of the tendons [N], shape (T, W, D).
    """
    away = np.linalg.norm(pose[..., :3] - start, axis=-1)
    inside = away <= task.drop_distance
    sine, cosine = half_turn(pose[:-1, :, 3:], pose[1:, :, 3:], np.array(task.axis))
    counted = inside[:-1] & inside[1:]
    before = np.vstack([np.ones_like(inside[:1]), inside[:-1]])
    return TurningFigures(
        seconds=period * len(pose),
        turned=np.sum(np.where(counted, 2.0 * np.arctan2(sine, cosine), 0.0), axis=0),
        drops=np.sum(before & ~inside, axis=0),
        tension=np.max(tension, axis=(0, 2)),
    )
