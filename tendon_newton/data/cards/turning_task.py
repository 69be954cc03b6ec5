"""What the card of a policy that turns a ball says of its task, and how far a ball has turned."""

from dataclasses import dataclass, field
from math import isclose, sqrt
from typing import Any, TypeVar

from tendon_newton.data.cards.card_json import Promise

LONGEST_DROP = 1.0  # Farthest distance that a card may call a drop [m]

Values = TypeVar("Values", bound=Any)  # NumPy arrays and torch tensors alike


@dataclass(frozen=True, kw_only=True)
class TurningTask:
    """Ball, axis and drop of a policy that turns a ball."""

    asset: str  # Hand with its ball: an asset's name
    # Axis of the commanded rate in the base frame [1], of length 1
    axis: tuple[float, float, float]
    # Distance of the ball's middle from where it starts beyond which it is dropped [m]
    drop_distance: float = field(metadata={"key": "drop_distance_m"})

    @property
    def promises(self) -> tuple[Promise, ...]:
        """What must hold: a name, what came, whether it holds, what is promised."""
        length = sqrt(sum(each * each for each in self.axis))
        return (
            ("turning.asset", self.asset, bool(self.asset), "the name of an asset"),
            ("turning.axis", self.axis, isclose(length, 1.0, abs_tol=1e-6),
                "a direction of length 1"),
            ("turning.drop_distance_m", self.drop_distance,
                0.0 < self.drop_distance <= LONGEST_DROP, f"up to {LONGEST_DROP:g} m"),
        )  # fmt: skip


def half_turn(before: Values, after: Values, axis: Values) -> tuple[Values, Values]:
    r"""Return sine and cosine of half the angle that bodies have turned about an axis.

    The turn is :math:`q_1 \bar q_0`, and its part about the axis the twist of Dobrowolski's
    swing-twist decomposition: :math:`2 \arctan(\vec v \cdot a / w)`.

    Args:
        before: Quaternions (x, y, z, w) from the body's axes to the base, shape (..., 4).
        after: Later quaternions, shape (..., 4).
        axis: Direction of length 1 in the base frame, shape (3,).
    """
    x0, y0, z0, w0 = (before[..., i] for i in range(4))
    x1, y1, z1, w1 = (after[..., i] for i in range(4))
    x = w0 * x1 - w1 * x0 - y1 * z0 + z1 * y0
    y = w0 * y1 - w1 * y0 - z1 * x0 + x1 * z0
    z = w0 * z1 - w1 * z0 - x1 * y0 + y1 * x0
    cosine = w0 * w1 + x0 * x1 + y0 * y1 + z0 * z1
    nearer = 1.0 - 2.0 * (cosine < 0.0)  # q and -q are the same turn
    return nearer * (axis[0] * x + axis[1] * y + axis[2] * z), nearer * cosine
