"""Obstacles and the links that meet them, as shapes of a Newton model.

Every capsule that a link carries can meet an obstacle; links meet each other where one of them is
an obstacle. An obstacle that moves is a body of its own, on a free joint behind the mechanism's
joints. Newton's own collision pipeline sees the same shapes, so that other solvers feel the same
contacts.

=========================  ==========  =========================================
``model.tendon.``          shape       meaning
=========================  ==========  =========================================
``obstacle_shape``         (W O,)      shape of an obstacle
``obstacle_stiffness``     (W O,)      force per depth [N/m]
``obstacle_dissipation``   (W O,)      by how much a closing speed raises it [s/m]
``obstacle_friction``      (W O,)      Coulomb's coefficient [1]
``bone_shape``             (W C,)      shape of a capsule that a link carries
``meeting_obstacle``       (W M,)      shape of a link's capsule that is an obstacle
``meeting_bone``           (W M,)      shape of another's that may press against it
=========================  ==========  =========================================
"""

from collections.abc import Sequence
from typing import Any

import newton
import numpy as np
import warp as wp

from tendon_newton.data.recording import Array
from tendon_newton.errors import InvalidAsset, InvalidParameter
from tendon_newton.mechanisms.geometry.joints import Joint
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.meetings import Meeting, bones_of
from tendon_newton.mechanisms.geometry.obstacles import Obstacle
from tendon_newton.mechanisms.usd.usd_tendon import (
    Attribute,
    add_attributes,
    add_frequency,
    register_tendon_attributes,
)

OBSTACLE = "tendon:obstacle"
BONE = "tendon:bone"
MEETING = "tendon:meeting"
_ATTRIBUTES: tuple[Attribute, ...] = (
    ("obstacle_shape", OBSTACLE, wp.int32, "shape", 0),
    ("obstacle_stiffness", OBSTACLE, wp.float32, None, 0.0),
    ("obstacle_dissipation", OBSTACLE, wp.float32, None, 0.0),
    ("obstacle_friction", OBSTACLE, wp.float32, None, 0.0),
    ("bone_shape", BONE, wp.int32, "shape", 0),
    ("meeting_obstacle", MEETING, wp.int32, "shape", 0),
    ("meeting_bone", MEETING, wp.int32, "shape", 0),
)
OBSTACLE_GROUP = 1  # Collision group of obstacles
# Collision group of links: Newton lets a negative one meet all others, but not itself. Links that
# are obstacles have the groups below.
BONE_GROUP = -1
# Just above the least coefficient that MuJoCo takes [1]. MuJoCo takes the greater coefficient of
# two shapes: the obstacle's.
LEAST_FRICTION = 2.0e-5
# Force [N] at which Newton's linear damper is as strong as the one that grows with the depth
USUAL_FORCE = 1.0


def register_contact_attributes(builder: newton.ModelBuilder) -> None:
    """Teach a builder the rows of obstacles and of the links that meet them."""
    for frequency in (OBSTACLE, BONE, MEETING):
        add_frequency(builder, frequency)
    add_attributes(builder, _ATTRIBUTES)


def with_shapes(mechanism: Mechanism) -> newton.ModelBuilder:
    """Return one world of a mechanism with its obstacles in it.

    Raises:
        InvalidAsset: No link carries a capsule, which could meet them.
        InvalidParameter: More than one of them moves.
    """
    obstacles, name = mechanism.obstacles, mechanism.name
    moving = sum(obstacle.mass is not None for obstacle in obstacles)
    if moving > 1:
        raise InvalidParameter(
            f"one obstacle of {name!r} may have a mass and move; {moving} have: free bodies do not "
            "meet each other"
        )
    builder = newton.ModelBuilder()
    register_tendon_attributes(builder)
    register_contact_attributes(builder)
    builder.add_builder(mechanism.template)
    bones = [bone.shape for bone in bones_of(builder)]
    if not bones:
        raise InvalidAsset(
            f"the links of {name!r} must carry capsules to meet an obstacle; they carry none"
        )
    for shape in bones:
        builder.shape_flags[shape] |= newton.ShapeFlags.COLLIDE_SHAPES
        builder.shape_collision_group[shape] = BONE_GROUP
        builder.shape_material_mu[shape] = LEAST_FRICTION
        builder.add_custom_values(**{"tendon:bone_shape": shape})
    links = {meeting.obstacle: meeting.shape for meeting in mechanism.meetings}
    _let_meet(builder, mechanism.meetings, bones)
    for number, obstacle in enumerate(obstacles):
        if number in links:  # a link's own capsule, whose contacts are like an obstacle's
            shape = links[number]
            builder.shape_material_ke[shape] = obstacle.stiffness
            builder.shape_material_kd[shape] = obstacle.dissipation * USUAL_FORCE
            builder.shape_material_mu[shape] = max(obstacle.friction, LEAST_FRICTION)
        else:
            shape = _add_shape(builder, obstacle, f"/{name}/obstacle_{number}")
        builder.add_custom_values(
            **{
                "tendon:obstacle_shape": shape,
                "tendon:obstacle_stiffness": obstacle.stiffness,
                "tendon:obstacle_dissipation": obstacle.dissipation,
                "tendon:obstacle_friction": obstacle.friction,
            }
        )
    return builder


def stretch_bones(model: Any, joints: Sequence[Joint], variants: Sequence[Sequence[Joint]]) -> None:
    """Stretch the capsules of links with the links, from their joints on.

    The model's shapes belong to the mechanism's `joints`; each world has its variant of them.
    """
    bones, bodies = model.tendon.bone_shape.numpy(), model.shape_body.numpy()
    places, sizes = model.shape_transform.numpy(), model.shape_scale.numpy()
    own = [joint for variant in variants for joint in variant]
    for bone in bones:
        joint, nominal = own[bodies[bone]], joints[bodies[bone] % len(joints)]
        if joint.length is not None and nominal.length is not None:
            stretch = joint.length / nominal.length
            anchor = nominal.child_position
            places[bone, :3] = anchor + stretch * (places[bone, :3] - anchor)
            sizes[bone, 1] *= stretch
    model.shape_transform.assign(places)
    model.shape_scale.assign(sizes)


def _let_meet(
    builder: newton.ModelBuilder, meetings: Sequence[Meeting], bones: Sequence[int]
) -> None:
    """Let capsules of links meet as they may, and no others."""
    pairs = [(meeting.shape, bone) for meeting in meetings for bone in meeting.met_by]
    for obstacle, bone in pairs:
        builder.add_custom_values(
            **{"tendon:meeting_obstacle": obstacle, "tendon:meeting_bone": bone}
        )
    for meeting in meetings:
        own = meeting.shape
        builder.shape_collision_group[own] = BONE_GROUP - 1 - meeting.obstacle
        for bone in bones:
            if bone != own and not {(own, bone), (bone, own)} & set(pairs):
                builder.add_shape_collision_filter_pair(own, bone)


def _add_shape(builder: newton.ModelBuilder, obstacle: Obstacle, label: str) -> int:
    """Add the shape of an obstacle, and return its number."""
    material = newton.ModelBuilder.ShapeConfig(
        ke=obstacle.stiffness,
        kd=obstacle.dissipation * USUAL_FORCE,
        mu=max(obstacle.friction, LEAST_FRICTION),
        collision_group=OBSTACLE_GROUP,
        density=0.0,
    )
    place = wp.transform(wp.vec3(*obstacle.position), quaternion(obstacle.rotation))
    body = -1
    if obstacle.mass is not None:
        body = builder.add_body(
            xform=place,
            mass=obstacle.mass,
            inertia=wp.mat33(*np.diag(obstacle.inertia).ravel()),
            lock_inertia=True,
            label=f"{label}_body",
        )
        place = wp.transform(wp.vec3(), wp.quat_identity())
    if obstacle.shape == "sphere":
        return builder.add_shape_sphere(
            body, xform=place, radius=float(obstacle.size[0]), cfg=material, label=label
        )
    if obstacle.shape == "box":
        hx, hy, hz = map(float, obstacle.size)
        return builder.add_shape_box(
            body, xform=place, hx=hx, hy=hy, hz=hz, cfg=material, label=label
        )
    return builder.add_shape_plane(
        None, xform=place, width=0.0, length=0.0, body=-1, cfg=material, label=label
    )


def quaternion(rotation: Array) -> wp.quat:
    """Return the quaternion of a rotation matrix."""
    matrix: Any = wp.mat33(*rotation.ravel())
    turned: Any = wp.quat_from_matrix(matrix)
    return turned
