"""Places of links and points of a mechanism, in numpy, for one posture."""

import numpy as np

from tendon_newton.data.recording import Array
from tendon_newton.mechanisms.geometry.joint_frames import Posture, frames_of
from tendon_newton.mechanisms.geometry.joints import Joint
from tendon_newton.mechanisms.geometry.mechanism import Mechanism


def posture(mechanism: Mechanism, joint_position: Array) -> Posture:
    """Compute the frames of a mechanism at joint positions (J,) [rad]."""
    return frames_of(mechanism.joints, joint_position)


def tip_position(mechanism: Mechanism, joint_position: Array) -> Array | None:
    """Return the tip in the base frame [m], shape (..., 3), at (..., J); None where there is none.

    Only its point is carried from link to link, since fits ask for thousands of postures.
    """
    if mechanism.tip is None:
        return None
    place, body = mechanism.tip.point, mechanism.tip.body
    while body >= 0:
        joint = mechanism.joints[body]
        point = (place - joint.child_position) @ joint.child_rotation
        moved = _carried(joint, joint_position[..., body, None], point)
        place, body = joint.parent_position + moved @ joint.parent_rotation.T, joint.parent
    return place


def _carried(joint: Joint, q: Array, point: Array) -> Array:
    """Return where a joint at q (..., 1) carries a point [m], (..., 3), in its own frame."""
    if joint.kind == "prismatic":
        return point + q * joint.axis
    x, y, z = joint.axis
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])  # Rodrigues, as in `frames_of`
    return point + np.sin(q) * (point @ K.T) + (1.0 - np.cos(q)) * (point @ (K @ K).T)


def chain_points(mechanism: Mechanism, joint_position: Array) -> list[Array]:
    """Return the ends of every bone of a posture [m]: where it starts, and what it carries."""
    frames = posture(mechanism, joint_position)
    tip = tip_position(mechanism, joint_position)
    bones = []
    for link, anchor in enumerate(frames.anchor):
        ends = [
            frames.anchor[child]
            for child, joint in enumerate(mechanism.joints)
            if joint.parent == link
        ]
        if tip is not None and mechanism.tip is not None and mechanism.tip.body == link:
            ends.append(tip)
        if not ends:
            center = mechanism.joints[link].center_of_mass
            ends = [frames.position[link] + frames.rotation[link] @ center]
        bones += [np.array([anchor, end]) for end in ends]
    return bones
