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
        self.path = closing_path(mechanism)
        order = np.argsort(self.path.excursion)
        self._angle = self.path.excursion[order] / mechanism.tendons[0].spool_radius
        self._joints = self.path.joint_position[order]
        straight = self.bones(np.zeros(len(mechanism.joints)))
        # Length of its bones together [m]
        self.size = sum(float(np.linalg.norm(b[1] - b[0])) for b in straight) or 1.0

    def joints_at(self, motor_angle: float) -> Array:
        """Return the joints [rad] at a motor angle [rad], shape (J,); a slack string pulls none."""
        return np.array([np.interp(motor_angle, self._angle, q) for q in self._joints.T])

    def bones(self, joint_position: Array) -> list[Array]:
        """Return the ends of each bone at positions (J,) [rad] as x and -z [m], (2, 2)."""
        bones = chain_points(self.mechanism, joint_position)
        return [np.column_stack([bone[:, 0], -bone[:, 2]]) for bone in bones]

    def extent(self) -> tuple[Array, Array]:
        """Return the least and greatest x and -z [m] of all its postures, shape (2,) each."""
        points = np.concatenate([p for q in self.path.joint_position for p in self.bones(q)])
        return points.min(axis=0), points.max(axis=0)

    def goal_point(self, alpha: float) -> tuple[float, float] | None:
        """Return x and z [m] of the tip's path at a goal angle [rad]; None without a tip."""
        if self.path.tip is None:
            return None
        x, z = self.path.tip[:, 0], self.path.tip[:, 2]
        row = int(np.argmin(np.abs(np.arctan2(-z, x) - alpha)))
        return float(x[row]), float(z[row])
