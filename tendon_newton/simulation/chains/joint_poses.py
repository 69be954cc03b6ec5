"""Where the joints of any tree are, and how they move what they carry."""

import warp as wp

from tendon_newton.device_code.placeholders import (
    LINKS,
    PARENT,
    REVOLUTE,
    JointVector,
    SpaceMatrix,
    TurnMatrix,
    Vec3,
    real,
)
from tendon_newton.device_code.structs import JointPose, Mechanism
from tendon_newton.device_code.templates import device_template
from tendon_newton.simulation.chains.spatial_chain import rotation_about, row, turn_of


@device_template
def joint_pose(mechanism: Mechanism, world: int, q: JointVector) -> JointPose:
    """Return origin [m] and axis of each joint and the rotation of its link, in the base's axes."""
    origin = SpaceMatrix()
    axis = SpaceMatrix()
    rotations = TurnMatrix()
    for j in range(LINKS):
        rotation = wp.identity(n=3, dtype=real)
        o = Vec3()
        if wp.static(PARENT[j] >= 0):
            rotation = turn_of(rotations, wp.static(PARENT[j]))
            o = row(origin, wp.static(PARENT[j]))
        o = o + rotation * mechanism.offset[world, j]
        z = rotation * mechanism.axis[world, j]
        if wp.static(REVOLUTE[j]):
            rotation = rotation * rotation_about(mechanism.axis[world, j], q[j])
        else:
            o = o + z * q[j]
        for i in range(3):
            for k in range(3):
                rotations[3 * j + i, k] = rotation[i, k]
            origin[j, i] = o[i]
            axis[j, i] = z[i]
    pose = JointPose()
    pose.origin = origin
    pose.axis = axis
    pose.rotation = rotations
    return pose


@device_template
def moved_by(origin: Vec3, axis: Vec3, turns: bool, point: Vec3) -> Vec3:
    """Return how a joint moves a point of a link that it carries [m/rad]."""
    out = axis
    if turns:
        out = wp.cross(axis, point - origin)
    return out
