"""Where a mechanism stands at a motor angle, as far as that angle tells: in equilibrium."""

import numpy as np

from tendon_newton.data.recording import Array
from tendon_newton.mechanisms.geometry.kinematics import chain_points
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.statics import closing_path


class ClosingPostures:
    """A mechanism's postures on its way along the friction-free equilibria.

    The first tendon closes the mechanism.

    Raises:
        InvalidParameter: The mechanism has no equilibrium.
    """

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism = mechanism
        path = closing_path(mechanism)
        order = np.argsort(path.excursion)
        self._angle = path.excursion[order] / mechanism.tendons[0].spool_radius
        self._joints = path.joint_position[order]

    def joints_at(self, motor_angle: float) -> Array:
        """Return the joints [rad] at a motor angle [rad], shape (J,); a slack string pulls none."""
        return np.array([np.interp(motor_angle, self._angle, q) for q in self._joints.T])

    def bones(self, joint_position: Array) -> list[Array]:
        """Return the ends of each bone at positions (J,) [rad] as x and -z [m], (2, 2)."""
        bones = chain_points(self.mechanism, joint_position)
        return [np.column_stack([bone[:, 0], -bone[:, 2]]) for bone in bones]
