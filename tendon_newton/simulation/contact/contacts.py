r"""Contact: what obstacles, and links that are some, do to the links that press against them.

A contact of depth :math:`\delta` pushes along its normal with

.. math:: F = k \delta (1 + \chi \dot\delta) \ge 0

and holds its link sideways like a spring and damper that give way to Coulomb's limit:

.. math:: T = -k_t s - c_t v_t, \qquad |T| \le \mu F

with :math:`s` the way slid since the spring was relaxed, less what the limit has let go. So a
contact really sticks, and all forces are continuous: no event divides a step.

Sources: Hunt and Crossley, J. Appl. Mech. 42 (1975), for F; Cundall and Strack, A discrete
numerical model for granular assemblies, Geotechnique 29 (1979), for T; Johnson, Contact Mechanics
(1985), chapter 7, for k_t / k.
"""

# The stubs of Warp know no sizes that are set later.
# pyright: reportOperatorIssue=false, reportReturnType=false

import warp as wp

from tendon_newton.device_code.placeholders import (
    BODY,
    CARRIES,
    CHAINS,
    CONTACT_MEMORY,
    CONTACT_TABLE,
    CONTACTS,
    HAS_BODY,
    HAS_PAIRS,
    JOINTS,
    MET_LINK,
    REVOLUTE,
    JointMatrix,
    JointVector,
    MemoryVector,
    SpaceMatrix,
    Vec3,
    real,
)
from tendon_newton.device_code.slots import contact_pose
from tendon_newton.device_code.structs import (
    ContactPose,
    ContactTerms,
    Drive,
    Grip,
    Mechanism,
    Overlap,
)
from tendon_newton.device_code.templates import device_template
from tendon_newton.simulation.chains.joint_poses import moved_by
from tendon_newton.simulation.chains.spatial_chain import row
from tendon_newton.simulation.contact.contact_distances import overlap_at, rest_overlap
from tendon_newton.simulation.contact.contact_plan import LINK_SHAPE, STRETCH
from tendon_newton.simulation.contact.contact_poses import end_of
from tendon_newton.simulation.contact.free_body import home_of, past_body, with_body_pose
from tendon_newton.simulation.contact.link_contacts import link_overlap, past_link

# Stiffness along a contact as a share of that across it, k_t / k [1]: 2 (1 - nu) / (2 - nu) with nu
# = 1/2, since skin and rubber keep their volume
SHEAR = 2.0 / 3.0
# Share [1] of the velocity gained since the start of a step that the way to its second stage has
# not seen: 1 - gamma of the integrator
WITHIN = 0.5**0.5
AFTER = 0.5  # Share of it that the end of a step has not seen [1]
RELAXED = 1.0e6  # Time [s] after which friction holds nothing any more: a world that settles


@device_template
def pose_at(mechanism: Mechanism, world: int, q: JointVector) -> ContactPose:
    """Place all that may touch."""
    pose = contact_pose(mechanism, world, q)
    if wp.static(HAS_BODY):
        pose = with_body_pose(mechanism, world, q, pose)
    return pose


@device_template
def overlap_of(
    mechanism: Mechanism,
    world: int,
    pose: ContactPose,
    capsule: int,
    obstacle: int,
    spot: int,
    shape: int,
) -> Overlap:
    """Return the overlap of one contact; none with an obstacle that is not there."""
    out = Overlap()
    home = home_of(world)
    if mechanism.obstacle_stiffness[home, obstacle] > real(0.0):
        place = mechanism.obstacle_position[home, obstacle]
        frame = mechanism.obstacle_rotation[home, obstacle]
        size = mechanism.obstacle_size[home, obstacle]
        radius = mechanism.capsule_radius[world, wp.max(capsule, 0)]
        if wp.static(HAS_BODY):
            if obstacle == wp.static(BODY):
                place = pose.body_place
                frame = pose.body_frame
        if capsule >= 0:
            start = end_of(pose.start, capsule)
            end = end_of(pose.end, capsule)
            out = overlap_at(start, end, radius, spot, place, frame, size, shape)
            if wp.static(HAS_PAIRS):
                if shape == wp.static(LINK_SHAPE):
                    out = link_overlap(mechanism, world, pose, capsule, obstacle)
        if wp.static(HAS_BODY):
            # the floor pushes once, however many chains there are
            if capsule < 0 and world == home * wp.static(CHAINS):
                body = mechanism.obstacle_size[home, wp.static(BODY)]
                out = rest_overlap(pose, body, spot, place, frame, size, shape)
    return out


@device_template
def material_of(mechanism: Mechanism, home: int, capsule: int, obstacle: int) -> Vec3:
    """Return stiffness [N/m], dissipation [s/m] and friction [1] of a contact.

    They are the obstacle's. Between a free body and a fixed obstacle the body gives way, and the
    smoother of the two decides the friction.
    """
    soft = int(obstacle)
    friction = mechanism.obstacle_friction[home, obstacle]
    if wp.static(HAS_BODY):
        if capsule < 0:
            soft = wp.static(BODY)
            friction = wp.min(friction, mechanism.obstacle_friction[home, soft])
    return Vec3(
        mechanism.obstacle_stiffness[home, soft],
        mechanism.obstacle_dissipation[home, soft],
        friction,
    )


@device_template
def grip_of(
    material: Vec3,
    touch: Overlap,
    columns: SpaceMatrix,
    v: JointVector,
    mean: JointVector,
    elapsed: real,
    kept: Vec3,
) -> Grip:
    """Return the forces of one contact, and how far friction has stretched it.

    Args:
        material: Stiffness [N/m], dissipation [s/m] and friction [1].
        touch: Where it is, and how deep.
        columns: How the joints move it [m/rad], shape (J, 3).
        v: Speeds of the joints.
        mean: Their mean speeds since the start of the step.
        elapsed: Time since then [s].
        kept: How far it was stretched then [m].
    """
    k = material[0]
    chi = material[1]
    speed = Vec3()
    drift = Vec3()
    for j in range(JOINTS):
        speed = speed + row(columns, j) * v[j]
        drift = drift + row(columns, j) * mean[j]
    opening = wp.dot(touch.normal, speed)
    elastic = k * touch.depth
    closing = real(1.0) - chi * opening
    grip = Grip()
    if closing > real(0.0):
        grip.force = elastic * closing
        grip.stiffness = -k * closing
        grip.damping = -elastic * chi
        limit = material[2] * elastic * closing
        if limit > real(0.0) and elapsed < real(RELAXED):
            stretch = kept + elapsed * drift
            stretch = stretch - wp.dot(touch.normal, stretch) * touch.normal
            k_t = real(SHEAR) * k
            c_t = real(SHEAR) * chi * elastic
            drag = -(k_t * stretch + c_t * (speed - opening * touch.normal))
            size = wp.length(drag)
            share = real(1.0)
            direction = Vec3()
            if size > limit:
                share = limit / size
                direction = drag / size
            spring = k_t * wp.length(stretch)
            if spring > limit:
                stretch = (limit / spring) * stretch
            grip.drag = share * drag
            grip.direction = direction
            grip.shear_stiffness = -share * k_t
            grip.shear_damping = -share * c_t
            grip.stretch = stretch
    return grip


@device_template
def grip_terms(grip: Grip) -> ContactTerms:
    """Return a contact's torque, and its derivatives."""
    columns = grip.columns
    push = JointVector()
    along = JointVector()
    torque = JointVector()
    stiffness = JointMatrix()
    damping = JointMatrix()
    for j in range(JOINTS):
        push[j] = wp.dot(grip.normal, row(columns, j))
        along[j] = wp.dot(grip.direction, row(columns, j))
        torque[j] = grip.force * push[j] + wp.dot(grip.drag, row(columns, j))
    for i in range(JOINTS):
        # A contact that slides answers to a change of its limit, one that sticks does not.
        across = push[i] + grip.friction * along[i]
        for j in range(JOINTS):
            side = wp.dot(row(columns, i), row(columns, j)) - push[i] * push[j]
            side = side - along[i] * along[j]
            stiffness[i, j] = grip.stiffness * across * push[j] + grip.shear_stiffness * side
            damping[i, j] = grip.damping * across * push[j] + grip.shear_damping * side
    out = ContactTerms()
    out.torque = torque
    out.stiffness = stiffness
    out.damping = damping
    return out


@device_template
def contact_columns(pose: ContactPose, link: int, obstacle: int, point: Vec3) -> SpaceMatrix:
    """Return how the coordinates move a point of a link past an obstacle [m/rad], shape (J, 3)."""
    columns = SpaceMatrix()
    carrier = wp.max(link, 0)
    for j in range(JOINTS):
        move = CARRIES[j, carrier] * moved_by(
            row(pose.origin, j), row(pose.axis, j), wp.static(REVOLUTE[j]), point
        )
        for i in range(3):
            columns[j, i] = move[i]
    if wp.static(HAS_PAIRS):
        columns = past_link(pose, columns, MET_LINK[obstacle], point)
    if wp.static(HAS_BODY):
        columns = past_body(pose, columns, link, obstacle, point)
    return columns


@device_template
def grip_at(
    mechanism: Mechanism, here: Drive, pose: ContactPose, contact: int, unseen: real
) -> Grip:
    """Return the forces of one contact; `unseen` is `WITHIN` or `AFTER` a step."""
    capsule = CONTACT_TABLE[contact, 0]
    obstacle = CONTACT_TABLE[contact, 1]
    touch = overlap_of(
        mechanism,
        here.world,
        pose,
        capsule,
        obstacle,
        CONTACT_TABLE[contact, 2],
        CONTACT_TABLE[contact, 3],
    )
    out = Grip()
    if touch.depth > real(0.0):
        columns = contact_columns(pose, CONTACT_TABLE[contact, 4], obstacle, touch.point)
        material = material_of(mechanism, home_of(here.world), capsule, obstacle)
        slot = wp.static(CONTACT_MEMORY) + wp.static(STRETCH) * contact
        kept = Vec3(here.memory[slot], here.memory[slot + 1], here.memory[slot + 2])
        mean = here.v - (unseen * here.elapsed) * here.acceleration
        out = grip_of(material, touch, columns, here.v, mean, here.elapsed, kept)
        out.depth = touch.depth
        out.normal = touch.normal
        out.friction = material[2]
        out.columns = columns
    return out


@device_template
def contact_terms(mechanism: Mechanism, here: Drive) -> ContactTerms:
    """Return the joint torques of all contacts, and their derivatives."""
    pose = pose_at(mechanism, here.world, here.q)
    torque = JointVector()
    stiffness = JointMatrix()
    damping = JointMatrix()
    # A loop that stays one: a compiler takes long over many contacts, and a tape needs no state
    # of a sum to walk it back.
    count = int(CONTACTS)
    for contact in range(count):
        grip = grip_at(mechanism, here, pose, contact, real(WITHIN))
        if grip.depth > real(0.0):
            own = grip_terms(grip)
            torque = torque + own.torque
            stiffness = stiffness + own.stiffness
            damping = damping + own.damping
    out = ContactTerms()
    out.torque = torque
    out.stiffness = stiffness
    out.damping = damping
    return out


@device_template
def contact_memory(mechanism: Mechanism, here: Drive, memory: MemoryVector) -> MemoryVector:
    """Renew how far friction has stretched each contact; one that has opened forgets."""
    out = memory
    pose = pose_at(mechanism, here.world, here.q)
    count = int(CONTACTS)
    for contact in range(count):
        own = grip_at(mechanism, here, pose, contact, real(AFTER))
        for i in range(3):
            out[wp.static(CONTACT_MEMORY) + wp.static(STRETCH) * contact + i] = own.stretch[i]
    return out
