"""Where links and points of a mechanism are, in numpy, for one posture."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tendon_newton.mechanisms.mechanism import Mechanism
from tendon_newton.mechanisms.parts import Joint
from tendon_newton.recording import Array


@dataclass(frozen=True, kw_only=True)
class Posture:
    """World frames of every link and joint at one set of joint positions."""

    rotation: tuple[Array, ...]
    """From each link's frame to the world, J of shape (3, 3)."""
    position: tuple[Array, ...]
    """Origin of each link's frame [m], J of shape (3,)."""
    axis: tuple[Array, ...]
    """Each joint's axis in the world, J of shape (3,)."""
    anchor: tuple[Array, ...]
    """Each joint's origin in the world [m], J of shape (3,)."""


def posture(mechanism: Mechanism, joint_position: Array) -> Posture:
    """Compute the frames of a mechanism.

    Args:
        mechanism: The mechanism.
        joint_position: Joint positions [rad], shape (J,).
    """
    rotation: list[Array] = []
    position: list[Array] = []
    axis: list[Array] = []
    anchor: list[Array] = []
    for joint, q in zip(mechanism.joints, joint_position, strict=True):
        base = joint.parent < 0
        R = np.eye(3) if base else rotation[joint.parent]
        p = np.zeros(3) if base else position[joint.parent]
        origin = p + R @ joint.parent_position
        joint_rotation, slide = _motion(joint, float(q))
        frame = R @ joint.parent_rotation
        anchor.append(origin)
        axis.append(frame @ joint.axis)
        rotation.append(frame @ joint_rotation @ joint.child_rotation.T)
        position.append(origin + frame @ slide - rotation[-1] @ joint.child_position)
    return Posture(
        rotation=tuple(rotation), position=tuple(position), axis=tuple(axis), anchor=tuple(anchor)
    )


def _motion(joint: Joint, q: float) -> tuple[Array, Array]:
    """Return the rotation and the shift that a joint adds, in its own frame."""
    if joint.kind == "prismatic":
        return np.eye(3), joint.axis * q
    x, y, z = joint.axis
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    # Rodrigues: a turn by q about the unit axis.
    return np.eye(3) + np.sin(q) * K + (1.0 - np.cos(q)) * (K @ K), np.zeros(3)


def tip_position(mechanism: Mechanism, joint_position: Array) -> Array | None:
    """Return the tip in the base frame [m], shape (3,); None where there is none."""
    tip = mechanism.tip
    if tip is None:
        return None
    frames = posture(mechanism, joint_position)
    return frames.position[tip.body] + frames.rotation[tip.body] @ tip.point


def ancestors(mechanism: Mechanism, index: int) -> list[int]:
    """Return the joints that move a link: its own and all before it."""
    chain = []
    while index >= 0:
        chain.append(index)
        index = mechanism.joints[index].parent
    return chain
