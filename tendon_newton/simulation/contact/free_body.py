r"""A free body: the six coordinates of an obstacle that moves, behind those of its chain.

They say how far it has moved [m] and turned [rad, about the axes of the base] since a step began,
and their rates are its velocity and angular velocity. Contact couples the body to links as links
are coupled to each other, implicitly, and what pushes a link pushes the body back. The body's own
motion is

.. math:: m \dot v = m g, \qquad I \dot\omega = -\omega \times I \omega
"""

# The stubs of Warp know no sizes that are set later.
# pyright: reportOperatorIssue=false, reportReturnType=false

import warp as wp

from tendon_newton.device_code.placeholders import (
    BODY,
    CHAINS,
    FIRST_BODY,
    JOINTS,
    SHARES_BODY,
    JointVector,
    Mat33,
    Quaternion,
    SpaceMatrix,
    Vec3,
    real,
)
from tendon_newton.device_code.structs import ChainTerms, ContactPose, Drive, Forces, Mechanism
from tendon_newton.device_code.templates import device_template

# Angle [rad] below which two terms of a series are its sine and cosine to rounding
SMALL_TURN = 1.0e-3


@device_template
def home_of(chain: int) -> int:
    """Return the world that a chain is of."""
    return chain // wp.static(CHAINS)


@device_template
def way_in(q: JointVector) -> Vec3:
    """Return how far a body has moved in a step [m], or from its rates how fast it moves."""
    first = wp.static(FIRST_BODY)
    return Vec3(q[first], q[first + 1], q[first + 2])


@device_template
def turn_in(q: JointVector) -> Vec3:
    """Return how far a body has turned in a step [rad], or from its rates how fast it turns."""
    first = wp.static(FIRST_BODY)
    return Vec3(q[first + 3], q[first + 4], q[first + 5])


@device_template
def with_body(q: JointVector, way: Vec3, turn: Vec3) -> JointVector:
    """Return coordinates, or their rates, with those of a body."""
    out = q
    for i in range(3):
        out[wp.static(FIRST_BODY) + i] = way[i]
        out[wp.static(FIRST_BODY + 3) + i] = turn[i]
    return out


@device_template
def quaternion_of(turn: Vec3) -> Quaternion:
    """Return the quaternion of a turn [rad]."""
    angle = wp.length(turn)
    share = real(0.5) - angle * angle / real(48.0)
    if angle > real(SMALL_TURN):
        share = wp.sin(real(0.5) * angle) / angle
    return Quaternion(share * turn[0], share * turn[1], share * turn[2], wp.cos(real(0.5) * angle))


@device_template
def frame_of(turn: Quaternion) -> Mat33:
    """Return a body's axes as columns."""
    return wp.quat_to_matrix(turn)


@device_template
def with_body_pose(
    mechanism: Mechanism, world: int, q: JointVector, pose: ContactPose
) -> ContactPose:
    """Return where things are, with the body where its coordinates have it."""
    home = home_of(world)
    turned = frame_of(quaternion_of(turn_in(q)))
    out = pose
    out.body_place = mechanism.obstacle_position[home, wp.static(BODY)] + way_in(q)
    out.body_frame = turned * mechanism.obstacle_rotation[home, wp.static(BODY)]
    return out


@device_template
def past_body(
    pose: ContactPose, columns: SpaceMatrix, link: int, obstacle: int, point: Vec3
) -> SpaceMatrix:
    """Return how the coordinates move one thing past another at a point, shape (J, 3).

    A body that is pressed by a link moves away below it; on a fixed obstacle it is what moves.
    """
    side = real(0.0)
    out = columns
    if obstacle == wp.static(BODY):
        side = -real(1.0)
    if link < 0:
        side = real(1.0)
        out = SpaceMatrix()
    arm = point - pose.body_place
    for i in range(3):
        unit = Vec3()
        unit[i] = side
        turning = wp.cross(unit, arm)
        for k in range(3):
            out[wp.static(FIRST_BODY) + i, k] = unit[k]
            out[wp.static(FIRST_BODY + 3) + i, k] = turning[k]
    return out


@device_template
def inertia_of_body(mechanism: Mechanism, world: int, q: JointVector) -> Mat33:
    """Return the body's inertia in the axes of the base [kg m2]."""
    home = home_of(world)
    turned = frame_of(quaternion_of(turn_in(q)))
    frame = turned * mechanism.obstacle_rotation[home, wp.static(BODY)]
    return frame * wp.diag(mechanism.body_inertia[home]) * wp.transpose(frame)


@device_template
def body_weight(mechanism: Mechanism, here: Drive) -> Vec3:
    """Return the body's weight [N] on a bench that may be tipped about +y."""
    home = home_of(here.world)
    fall = mechanism.body_gravity[home]
    upright = Vec3(real(0.0), real(1.0), real(0.0))
    across = wp.cross(upright, fall)
    along = -wp.cross(upright, across)
    tipped = fall - wp.sin(here.tilt) * across - (real(1.0) - wp.cos(here.tilt)) * along
    return mechanism.body_mass[home] * tipped


@device_template
def with_body_terms(mechanism: Mechanism, here: Drive, chain: ChainTerms) -> ChainTerms:
    """Return mass matrix and torque of a chain and its free body."""
    mass_matrix = chain.mass_matrix
    inertia = inertia_of_body(mechanism, here.world, here.q)
    spin = turn_in(here.v)
    bias = -wp.cross(spin, inertia * spin)
    for i in range(3):
        place = wp.static(FIRST_BODY) + i
        mass_matrix[place, place] = mechanism.body_mass[home_of(here.world)]
        for k in range(3):
            mass_matrix[wp.static(FIRST_BODY + 3) + i, wp.static(FIRST_BODY + 3) + k] = inertia[
                i, k
            ]
    out = ChainTerms()
    out.mass_matrix = mass_matrix
    out.torque = with_body(chain.torque, body_weight(mechanism, here), bias)
    if wp.static(SHARES_BODY):
        out.torque = out.torque + here.load
    return out


@device_template
def with_still_body(forces: Forces) -> Forces:
    """Return forces in which the body stays where it is, whatever presses it."""
    mass_matrix = forces.mass_matrix
    stiffness = forces.stiffness
    torque = forces.torque
    for c in range(FIRST_BODY, JOINTS):
        for j in range(JOINTS):
            mass_matrix[c, j] = real(0.0)
            mass_matrix[j, c] = real(0.0)
            stiffness[c, j] = real(0.0)
            stiffness[j, c] = real(0.0)
        mass_matrix[c, c] = real(1.0)
        stiffness[c, c] = -real(1.0)
        torque[c] = real(0.0)
    out = forces
    out.mass_matrix = mass_matrix
    out.stiffness = stiffness
    out.torque = torque
    return out
