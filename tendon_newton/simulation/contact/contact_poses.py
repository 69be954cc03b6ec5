"""Where joints and capsules are, in the axes of the base, for chains in a plane and in space."""

import warp as wp

from tendon_newton.device_code.placeholders import (
    CAPSULE_LINK,
    CAPSULES,
    LINKS,
    PARENT,
    REVOLUTE,
    CapsuleMatrix,
    JointVector,
    PlaneMatrix,
    SpaceMatrix,
    Vec2,
    Vec3,
    real,
)
from tendon_newton.device_code.structs import ContactPose, Mechanism
from tendon_newton.device_code.templates import device_template
from tendon_newton.simulation.chains.joint_poses import joint_pose
from tendon_newton.simulation.chains.planar_chain import turn
from tendon_newton.simulation.chains.spatial_chain import row, turn_of


@device_template
def end_of(matrix: CapsuleMatrix, capsule: int) -> Vec3:
    """Return one row of a (C, 3) matrix."""
    return Vec3(matrix[capsule, 0], matrix[capsule, 1], matrix[capsule, 2])


@device_template
def planar_pose(mechanism: Mechanism, world: int, q: JointVector) -> ContactPose:
    """Place joints and capsules of a chain in a plane; what they meet need not lie in it."""
    direction = PlaneMatrix()
    place = PlaneMatrix()
    origin = SpaceMatrix()
    axis = SpaceMatrix()
    start = CapsuleMatrix()
    end = CapsuleMatrix()
    out_of_plane = wp.transpose(mechanism.contact_plane[world])
    for j in range(LINKS):
        u = Vec2(real(1.0), real(0.0))
        o = Vec2(real(0.0), real(0.0))
        if wp.static(PARENT[j] >= 0):
            u = Vec2(direction[wp.static(PARENT[j]), 0], direction[wp.static(PARENT[j]), 1])
            o = Vec2(place[wp.static(PARENT[j]), 0], place[wp.static(PARENT[j]), 1])
        z = Vec3(real(0.0), real(0.0), real(1.0))
        o = o + turn(u, mechanism.offset[world, j])
        if wp.static(REVOLUTE[j]):
            u = turn(u, Vec2(wp.cos(q[j]), wp.sin(q[j])))
        else:
            slide = turn(u, mechanism.axis[world, j])
            o = o + slide * q[j]
            z = Vec3(slide[0], slide[1], real(0.0))
        from_plane = out_of_plane * Vec3(o[0], o[1], real(0.0))
        z = out_of_plane * z
        for i in range(2):
            direction[j, i] = u[i]
            place[j, i] = o[i]
        for i in range(3):
            origin[j, i] = from_plane[i]
            axis[j, i] = z[i]
    for c in range(wp.static(CAPSULES)):
        link = wp.static(CAPSULE_LINK[c])
        u = Vec2(direction[link, 0], direction[link, 1])
        o = Vec2(place[link, 0], place[link, 1])
        first = mechanism.capsule_start[world, c]
        last = mechanism.capsule_end[world, c]
        a = o + turn(u, Vec2(first[0], first[1]))
        b = o + turn(u, Vec2(last[0], last[1]))
        head = out_of_plane * Vec3(a[0], a[1], first[2])
        tail = out_of_plane * Vec3(b[0], b[1], last[2])
        for i in range(3):
            start[c, i] = head[i]
            end[c, i] = tail[i]
    pose = ContactPose()
    pose.origin = origin
    pose.axis = axis
    pose.start = start
    pose.end = end
    return pose


@device_template
def spatial_pose(mechanism: Mechanism, world: int, q: JointVector) -> ContactPose:
    """Place joints and capsules of any tree."""
    joints = joint_pose(mechanism, world, q)
    start = CapsuleMatrix()
    end = CapsuleMatrix()
    for c in range(wp.static(CAPSULES)):
        carrier = turn_of(joints.rotation, wp.static(CAPSULE_LINK[c]))
        o = row(joints.origin, wp.static(CAPSULE_LINK[c]))
        head = o + carrier * mechanism.capsule_start[world, c]
        tail = o + carrier * mechanism.capsule_end[world, c]
        for i in range(3):
            start[c, i] = head[i]
            end[c, i] = tail[i]
    pose = ContactPose()
    pose.origin = joints.origin
    pose.axis = joints.axis
    pose.start = start
    pose.end = end
    return pose
