"""Places of links and points of a mechanism, in numpy, for one posture."""

import numpy as np

from tendon_newton.data.recording import Array
from tendon_newton.mechanisms.geometry.joint_frames import Posture, frames_of
from tendon_newton.mechanisms.geometry.mechanism import Mechanism


def posture(mechanism: Mechanism, joint_position: Array) -> Posture:
    """Compute the frames of a mechanism at joint positions (J,) [rad]."""
    return frames_of(mechanism.joints, joint_position)


def tip_position(mechanism: Mechanism, joint_position: Array) -> Array | None:
    """Return the tip in the base frame [m], shape (3,); None where there is none."""
    tip = mechanism.tip
    if tip is None:
        return None
    frames = posture(mechanism, joint_position)
    return frames.place(tip.body, tip.point)


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
