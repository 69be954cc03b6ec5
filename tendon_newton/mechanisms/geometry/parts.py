"""Tendons and the tip of a mechanism."""

from dataclasses import dataclass

import numpy as np

from tendon_newton.data.recording import Array
from tendon_newton.errors import InvalidAsset
from tendon_newton.mechanisms.geometry.joints import ReadOnlyArrays, freeze_arrays
from tendon_newton.mechanisms.geometry.routing import Route


@dataclass(frozen=True, kw_only=True)
class Tendon:
    """One tendon, from its spool to the joints that it closes."""

    name: str  # Last element of its prim's path
    prim: str  # Path of its prim in the asset
    # Excursion per joint angle [m/rad], positive closes, shape (J,); at q = 0 for a routed one
    moment_arm: Array
    spool_radius: float  # The motor angle is the excursion divided by this [m]
    force_limit: float  # The most that the servo can pull [N]
    excursion_offset: float = 0.0  # Excursion at q = 0 [m]
    servo: str = ""  # Name of the servo that winds it, or empty
    direct: bool = False  # Whether a shaft stands in for the string: it pushes as well as pulls
    # Path through sites and around pulleys; None where its moment arms are constant
    route: Route | None = None

    def __post_init__(self) -> None:
        freeze_arrays(self)
        if self.spool_radius <= 0.0:
            raise InvalidAsset(
                f"{self.prim} has a spool radius of {self.spool_radius:g} m; it must be > 0."
            )


@dataclass(frozen=True, kw_only=True)
class Tip(ReadOnlyArrays):
    """The point that a recording follows."""

    body: int  # Body in each world that carries it; the joint of the same number moves that body
    point: Array  # Place in that body's frame [m], shape (3,)


def moment_arms(tendon: Tendon, joint_position: Array) -> Array:
    """Return the moment arms of a tendon at joint positions (..., J) [rad], in [m/rad], (..., J).

    Moment arms are constant for a fixed tendon and follow from the path of a routed one.
    """
    if tendon.route is not None:
        return tendon.route.moment_arms(np.asarray(joint_position, dtype=np.float64))
    return np.broadcast_to(tendon.moment_arm, np.shape(joint_position))


def arm_slope(tendon: Tendon, joint_position: Array) -> Array:
    """Return how a tendon's moment arms change with positions (J,) [rad], [m/rad^2], (J, J)."""
    if tendon.route is not None:
        return tendon.route.curvature(np.asarray(joint_position, dtype=np.float64))
    return np.zeros((tendon.moment_arm.size, tendon.moment_arm.size))


def excursion(tendon: Tendon, joint_position: Array) -> Array:
    """Return how much of a tendon is wound in at joint positions (..., J) [rad], in [m], (...).

    ``l = l_0 + sum_j arm_j q_j`` of a fixed tendon, ``l = l_0 + L(0) - L(q)`` of a routed one.
    """
    q = np.asarray(joint_position, dtype=np.float64)
    if tendon.route is not None:
        return tendon.excursion_offset + tendon.route.excursion(q)
    return tendon.excursion_offset + q @ tendon.moment_arm
