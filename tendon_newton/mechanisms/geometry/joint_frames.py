"""Where the links of a chain of joints are, and how one of their points moves seen from another."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tendon_newton.data.recording import Array
from tendon_newton.mechanisms.geometry.joints import Joint


@dataclass(frozen=True, kw_only=True)
class Posture:
    """World frames of every link and joint at one set of joint positions, or at many."""

    rotation: tuple[Array, ...]  # From each link's frame to the world, J of shape (..., 3, 3)
    position: tuple[Array, ...]  # Origin of each link's frame [m], J of shape (..., 3)
    axis: tuple[Array, ...]  # Each joint's axis in the world, J of shape (..., 3)
    anchor: tuple[Array, ...]  # Each joint's origin in the world [m], J of shape (..., 3)

    def place(self, body: int, point: Array) -> Array:
        """Return a point of a link in the world [m], shape (..., 3); link -1 is the base."""
        return point if body < 0 else self.position[body] + self.rotation[body] @ point

    def turned(self, body: int, rotation: Array) -> Array:
        """Return a rotation of a link's in the world, shape (3, 3); link -1 is the base."""
        return rotation if body < 0 else self.rotation[body] @ rotation


def frames_of(joints: tuple[Joint, ...], joint_position: Array) -> Posture:
    """Compute the frames of a tree of joints, parents first, at positions (..., J) [rad]."""
    rotation: list[Array] = []
    position: list[Array] = []
    axis: list[Array] = []
    anchor: list[Array] = []
    for j, joint in enumerate(joints):
        base = joint.parent < 0
        R = np.eye(3) if base else rotation[joint.parent]
        p = np.zeros(3) if base else position[joint.parent]
        origin = p + R @ joint.parent_position
        joint_rotation, slide = _motion(joint, joint_position[..., j])
        frame = R @ joint.parent_rotation
        anchor.append(origin)
        axis.append(frame @ joint.axis)
        rotation.append(frame @ joint_rotation @ joint.child_rotation.T)
        position.append(
            origin + (frame @ slide[..., None])[..., 0] - rotation[-1] @ joint.child_position
        )
    return Posture(
        rotation=tuple(rotation), position=tuple(position), axis=tuple(axis), anchor=tuple(anchor)
    )


def _motion(joint: Joint, q: Array) -> tuple[Array, Array]:
    """Return the rotation and the shift that a joint at q (...) adds, in its own frame."""
    q = np.asarray(q)[..., None]
    if joint.kind == "prismatic":
        return np.eye(3), joint.axis * q
    x, y, z = joint.axis
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    # Rodrigues: a turn by q about the unit axis.
    q = q[..., None]
    return np.eye(3) + np.sin(q) * K + (1.0 - np.cos(q)) * (K @ K), np.zeros(3)


def way_between(parents: tuple[int, ...], seen_from: int, body: int) -> tuple[tuple[int, int], ...]:
    """Return the joints that move a link as seen from another, outwards from the second.

    Each comes with +1 where it carries the link, and -1 where it carries the one that looks. A body
    or a parent of -1 is the base.
    """
    looking, carrying = ancestors(parents, seen_from), ancestors(parents, body)
    up = [(joint, -1) for joint in looking if joint not in carrying]
    down = [(joint, 1) for joint in reversed(carrying) if joint not in looking]
    return (*up, *down)


def ancestors(parents: Sequence[int], body: int) -> list[int]:
    """Return the joints that move a link: its own and all before it."""
    line = []
    while body >= 0:
        line.append(body)
        body = parents[body]
    return line


def cross(a: Array, b: Array) -> Array:
    """Return the cross product of two vectors; numpy's own takes ten times as long for one."""
    x, y, z = a.tolist()
    u, v, w = b.tolist()
    return np.array([y * w - z * v, z * u - x * w, x * v - y * u])


def relative_motion(
    joints: tuple[Joint, ...], frames: Posture, way: tuple[tuple[int, int], ...], point: Array
) -> tuple[Array, Array]:
    """Return first and second derivatives of a point by the joints, as seen from a link.

    The point (3,) [m] and the derivatives, (J, 3) and (J, J, 3), are in the axes of the world;
    `way_between` gives the way.
    """
    first = np.zeros((len(joints), 3))
    second = np.zeros((len(joints), len(joints), 3))
    for place, (k, sign) in enumerate(way):
        axis = frames.axis[k]
        turns = joints[k].kind == "revolute"
        first[k] = sign * (cross(axis, point - frames.anchor[k]) if turns else axis)
        for j, outer in way[: place + 1]:
            if joints[j].kind == "revolute":
                second[j, k] = second[k, j] = outer * cross(frames.axis[j], first[k])
    return first, second
