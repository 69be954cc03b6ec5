"""Goal points of a finger's tip: one for every goal angle."""

import numpy as np
import torch
from torch import Tensor

from tendon_newton.data.cards.policy_observation import goal_angle
from tendon_newton.data.recording import Array
from tendon_newton.errors import InvalidParameter
from tendon_newton.mechanisms.geometry.kinematics import posture
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.parts import excursion
from tendon_newton.mechanisms.geometry.statics import closed_position, closing_path, closing_tendons

POINTS = 1025  # Goal points in the table
EQUILIBRIA = 201
"""Postures from which they are interpolated; the points are off the path by less than 10 um."""


class GoalPath:
    """The path of the tip while tendons close the nominal finger without friction and gravity.

    All tendons that close pull with one tension, and those that open hang loose. A goal angle
    alpha, seen from the first joint's axis, means the point of the path with that angle.

    Raises:
        InvalidParameter: The bench is no such finger.
    """

    def __init__(self, mechanism: Mechanism, device: torch.device | str = "cpu") -> None:
        alpha, tip = tip_path(mechanism)
        # Angles from the open to the closed finger [rad]
        self.range = (float(alpha[0]), float(alpha[-1]))
        grid = np.linspace(*self.range, POINTS)
        table = np.column_stack([np.interp(grid, alpha, tip[:, axis]) for axis in range(3)])
        self._table = torch.tensor(table, dtype=torch.float32, device=device)

    def points(self, alpha: Tensor) -> Tensor:
        """Return the goal points [m] of goal angles [rad], shape (W, 3) for (W,).

        An angle beyond the path means its end.
        """
        low, high = self.range
        place = ((alpha - low) * ((POINTS - 1) / (high - low))).clamp(0.0, POINTS - 1.0)
        first = place.floor().clamp(max=POINTS - 2.0)
        start = self._table[first.long()]
        return start + (place - first)[:, None] * (self._table[first.long() + 1] - start)

    def require(self, goals: tuple[float, float]) -> None:
        """Refuse goal angles [rad] that are not on the path.

        Raises:
            InvalidParameter: Some are not.
        """
        low, high = self.range
        if not low - 1.0e-6 <= goals[0] <= goals[1] <= high + 1.0e-6:
            raise InvalidParameter(
                f"goals must be angles that this finger passes, {low:.3f} to {high:.3f} rad; they "
                f"are {goals[0]:.3f} to {goals[1]:.3f} rad"
            )


def tip_path(mechanism: Mechanism) -> tuple[Array, Array]:
    """Return goal angles [rad], (N,), and the tip's path [m], (N, 3)."""
    closing = closing_tendons(mechanism)
    if mechanism.tip is None or not closing:
        raise InvalidParameter(
            f"a policy moves the tip of a finger that tendons close; {mechanism.name!r} has "
            f"{len(closing)} of them and {'no' if mechanism.tip is None else 'a'} tip"
        )
    path = closing_path(mechanism, tendon=closing, count=EQUILIBRIA, gravity=np.zeros(3))
    assert path.tip is not None
    seen = path.tip - posture(mechanism, np.zeros(len(mechanism.joints))).anchor[0]
    alpha = np.unwrap(goal_angle(seen[:, 0], seen[:, 2]))
    if np.any(np.diff(alpha) <= 0.0):
        raise InvalidParameter(
            f"a goal angle must mean one point; the tip of {mechanism.name!r} comes back to angles "
            "that it has passed"
        )
    return alpha, path.tip


def of_each_servo(
    mechanism: Mechanism, angles: tuple[float, float], spool_radius: float
) -> tuple[tuple[float, float], ...]:
    """Return two motor angles, such as the ends of the command range, of each servo [rad].

    Those of a servo that opens count from where its string is all let out: in the closed finger.

    Args:
        angles: Those of a servo that closes [rad].
        spool_radius: Radius of all spools [m].
    """
    closing, closed = closing_tendons(mechanism), closed_position(mechanism)
    starts = [
        0.0 if d in closing else float(excursion(tendon, closed)) / spool_radius
        for d, tendon in enumerate(mechanism.tendons)
    ]
    low, high = angles
    return tuple((low + start, high + start) for start in starts)
