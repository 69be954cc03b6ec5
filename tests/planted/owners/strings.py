"""How much string the joints of a planar finger take up: lengths past each joint, from a table."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Place = tuple[float, float]


@dataclass(frozen=True, kw_only=True)
class Crossing:
    """A string's way past one joint, seen from its axis while the finger is straight [m]."""

    before: Place  # The guide ahead of the joint
    behind: Place  # The guide beyond it, which turns with it
    pulley: Place = (0.0, 0.0)  # Centre of what the string may lie on, which does not turn
    radius: float = 0.0  # Its radius to the middle of the string; 0 is none


def crossing(way: Crossing, turn: Array) -> Array:
    """Return a string's length [m] past a joint that has turned; a pulley lies below it."""
    far_x, far_z = way.behind
    x = far_x * np.cos(turn) + far_z * np.sin(turn) - way.pulley[0]
    z = far_z * np.cos(turn) - far_x * np.sin(turn) - way.pulley[1]
    first = (way.before[0] - way.pulley[0], way.before[1] - way.pulley[1])
    straight = np.hypot(x - first[0], z - first[1])
    if way.radius == 0.0:
        return straight
    near, far = np.hypot(*first), np.hypot(x, z)
    start = np.arctan2(first[1], first[0]) - np.arccos(way.radius / near)
    end = np.arctan2(z, x) + np.arccos(way.radius / far)
    free = np.sqrt(near**2 - way.radius**2) + np.sqrt(far**2 - way.radius**2)
    return np.where(start > end, free + way.radius * (start - end), straight)


class Strings:
    """How much string the joints take up, and their moment arms, from a table of angles."""

    def __init__(self, paths: Sequence[Sequence[Crossing]]) -> None:
        self.start, self.width = -0.3, 1e-3
        turn = self.start + self.width * np.arange(2201)
        lengths = np.array([[crossing(way, turn) for way in path] for path in paths])
        rest = round(-self.start / self.width)
        self.taken = lengths[..., rest : rest + 1] - lengths
        self.arm = np.gradient(self.taken, self.width, axis=-1, edge_order=2)

    def at(self, q: Array) -> tuple[Array, Array]:
        """Return excursions [m], shape (B, S), and arms [m], (B, S, J)."""
        place = (q - self.start) / self.width
        low = np.clip(place.astype(np.intp), 0, self.taken.shape[-1] - 2)
        share = place - low
        joint = np.arange(q.shape[1])
        taken = self.taken[:, joint, low] * (1.0 - share) + self.taken[:, joint, low + 1] * share
        arm = self.arm[:, joint, low] * (1.0 - share) + self.arm[:, joint, low + 1] * share
        return taken.sum(axis=-1).T, arm.transpose(1, 0, 2)
