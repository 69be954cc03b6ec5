r"""Routed tendons on the device: length, moment arms and curvature as in `mechanisms.routing`.

Everything about a span is looked at from one link, its pulley's or that of its start, so that only
the joints between that link and the span's ends move it. Which those are is fixed in code.

The equations of motion need three things of a tendon whose arms :math:`A(q) = dl/dq` are not
constant, all from the second derivatives :math:`H` of the excursion :math:`l(q)`: its acceleration
:math:`\ddot l = A \ddot q + \dot q^T H \dot q`, the torque of a rotor that it turns, and the
geometric stiffness :math:`T H` of a tension :math:`T`.
"""

# The stubs of Warp know no sizes that are set later.
# pyright: reportOperatorIssue=false, reportReturnType=false

from __future__ import annotations

import warp as wp

from tendon_newton.device_code.placeholders import (
    JOINTS,
    ArmMatrix,
    JointMatrix,
    JointVector,
    Mat33,
    Placeholder,
    SpaceMatrix,
    TendonVector,
    TurnMatrix,
    Vec3,
    real,
)
from tendon_newton.device_code.templates import device_template
from tendon_newton.simulation.spatial_chain import rotation_about, row, turn_of

Drive = Placeholder
FrameMatrix = Placeholder
Mechanism = Placeholder
PathMatrix = Placeholder
Pose = Placeholder
SpanTerms = Placeholder
PARENT: tuple[int, ...] = ()
REVOLUTE: tuple[bool, ...] = ()
ROUTED = False
POINTS = 0
SPANS = 0
POINT_BODY: tuple[int, ...] = ()
SPAN_TENDON: tuple[int, ...] = ()
SPAN_START: tuple[int, ...] = ()
SPAN_END: tuple[int, ...] = ()
SPAN_PULLEY: tuple[int, ...] = ()
START_SIGN: tuple[tuple[int, ...], ...] = ()
START_PAIR: tuple[tuple[tuple[bool, ...], ...], ...] = ()
END_SIGN: tuple[tuple[int, ...], ...] = ()
END_PAIR: tuple[tuple[tuple[bool, ...], ...], ...] = ()

QUARTER = 0.5 * wp.pi
"""A string that passes its pulley freely spans less than nothing of it, down to this [rad]."""
TURN = 2.0 * wp.pi


@device_template
def route_pose(mechanism: Mechanism, world: int, q: JointVector) -> Pose:
    """Return where joints and path points are, and how the pulleys are turned."""
    origin = SpaceMatrix()
    axis = SpaceMatrix()
    places = PathMatrix()
    frames = FrameMatrix()
    rotations = TurnMatrix()
    for j in range(JOINTS):
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
    for n in range(wp.static(POINTS)):
        place = mechanism.path_point[world, n]
        frame = mechanism.path_frame[world, n]
        if wp.static(POINT_BODY[n] >= 0):
            carrier = turn_of(rotations, wp.static(POINT_BODY[n]))
            place = row(origin, wp.static(POINT_BODY[n])) + carrier * place
            frame = carrier * frame
        for i in range(3):
            places[n, i] = place[i]
            for k in range(3):
                frames[3 * n + k, i] = frame[i, k]
    pose = Pose()
    pose.origin = origin
    pose.axis = axis
    pose.place = places
    pose.frame = frames
    return pose


@device_template
def path_row(matrix: PathMatrix, index: int) -> Vec3:
    """Return one path point [m]."""
    return Vec3(matrix[index, 0], matrix[index, 1], matrix[index, 2])


@device_template
def frame_row(matrix: FrameMatrix, index: int) -> Vec3:
    """Return one axis of a pulley: three rows each."""
    return Vec3(matrix[index, 0], matrix[index, 1], matrix[index, 2])


@device_template
def free_span(away: Vec3) -> SpanTerms:
    """Return a straight span: its length [m] and its derivatives by both ends."""
    terms = SpanTerms()
    terms.length = wp.length(away)
    u = away / terms.length
    block = (wp.identity(n=3, dtype=real) - wp.outer(u, u)) / terms.length
    terms.start = -u
    terms.end = u
    terms.start_start = block
    terms.start_end = -block
    terms.end_end = block
    return terms


@device_template
def wrapped_angle(a: Vec3, b: Vec3, radius: real, turn: real) -> real:
    """Return over which angle a string touches a pulley [rad]; negative: it passes by."""
    rho_a = wp.sqrt(a[0] * a[0] + a[1] * a[1])
    rho_b = wp.sqrt(b[0] * b[0] + b[1] * b[1])
    arc = real(-1.0)
    if rho_a > radius and rho_b > radius:
        angle = turn * wp.atan2(a[0] * b[1] - a[1] * b[0], a[0] * b[0] + a[1] * b[1])
        if angle < -real(QUARTER):
            angle = angle + real(TURN)
        arc = angle - wp.acos(radius / rho_a) - wp.acos(radius / rho_b)
    return arc


@device_template
def wrapped_span(a: Vec3, b: Vec3, arc: real, radius: real, turn: real) -> SpanTerms:
    """Return a span around a pulley, in the pulley's frame."""
    rho_a = wp.sqrt(a[0] * a[0] + a[1] * a[1])
    rho_b = wp.sqrt(b[0] * b[0] + b[1] * b[1])
    free_a = wp.sqrt(rho_a * rho_a - radius * radius)
    free_b = wp.sqrt(rho_b * rho_b - radius * radius)
    flat = free_a + free_b + radius * arc
    height = b[2] - a[2]
    length = wp.sqrt(flat * flat + height * height)
    share = flat / length
    slope_a = rolled_slope(a, rho_a, free_a, radius, -turn)
    slope_b = rolled_slope(b, rho_b, free_b, radius, turn)
    up = Vec3(real(0.0), real(0.0), real(1.0))
    terms = SpanTerms()
    terms.length = length
    terms.start = share * slope_a - (height / length) * up
    terms.end = share * slope_b + (height / length) * up
    lift = wp.outer(up, up)
    # Gradients by both ends are one vector of six: its outer products fill all three blocks.
    terms.start_start = (
        wp.outer(slope_a, slope_a) + flat * rolled_bend(a, rho_a, free_a, radius, -turn) + lift
        - wp.outer(terms.start, terms.start)
    ) / length  # fmt: skip
    terms.start_end = (
        wp.outer(slope_a, slope_b) - lift - wp.outer(terms.start, terms.end)
    ) / length  # fmt: skip
    terms.end_end = (
        wp.outer(slope_b, slope_b) + flat * rolled_bend(b, rho_b, free_b, radius, turn) + lift
        - wp.outer(terms.end, terms.end)
    ) / length  # fmt: skip
    return terms


@device_template
def rolled_slope(site: Vec3, rho: real, free: real, radius: real, turn: real) -> Vec3:
    """Return the gradient of the flat length by one end [1]."""
    radial = Vec3(site[0] / rho, site[1] / rho, real(0.0))
    around = Vec3(-radial[1], radial[0], real(0.0))
    return (free / rho) * radial + (turn * radius / rho) * around


@device_template
def rolled_bend(site: Vec3, rho: real, free: real, radius: real, turn: real) -> Mat33:
    """Return the second derivatives of the flat length by one end [1/m]."""
    radial = Vec3(site[0] / rho, site[1] / rho, real(0.0))
    around = Vec3(-radial[1], radial[0], real(0.0))
    square = rho * rho
    mixed = wp.outer(radial, around) + wp.outer(around, radial)
    bend = (radius * radius / (free * square)) * wp.outer(radial, radial)
    bend = bend + (free / square) * wp.outer(around, around)
    return bend - (turn * radius / square) * mixed


@device_template
def span_terms(
    mechanism: Mechanism, world: int, pose: Pose, start: int, end: int, pulley: int
) -> SpanTerms:
    """Return a span in the axes of the world: length [m], and its derivatives by both ends."""
    a = path_row(pose.place, start)
    b = path_row(pose.place, end)
    terms = SpanTerms()
    arc = real(-1.0)
    if pulley >= 0:
        centre = path_row(pose.place, pulley)
        x = frame_row(pose.frame, 3 * pulley)
        y = frame_row(pose.frame, 3 * pulley + 1)
        z = frame_row(pose.frame, 3 * pulley + 2)
        from_a = a - centre
        from_b = b - centre
        own_a = Vec3(wp.dot(x, from_a), wp.dot(y, from_a), wp.dot(z, from_a))
        own_b = Vec3(wp.dot(x, from_b), wp.dot(y, from_b), wp.dot(z, from_b))
        radius = mechanism.path_radius[world, pulley]
        turn = mechanism.path_turn[world, pulley]
        arc = wrapped_angle(own_a, own_b, radius, turn)
        if arc > real(0.0):
            own = wrapped_span(own_a, own_b, arc, radius, turn)
            frame = Mat33(x[0], y[0], z[0], x[1], y[1], z[1], x[2], y[2], z[2])
            back = wp.transpose(frame)
            terms.length = own.length
            terms.start = frame * own.start
            terms.end = frame * own.end
            terms.start_start = frame * own.start_start * back
            terms.start_end = frame * own.start_end * back
            terms.end_end = frame * own.end_end * back
    if arc <= real(0.0):
        terms = free_span(b - a)
    return terms


@device_template
def column(pose: Pose, j: int, turns: bool, sign: real, point: Vec3) -> Vec3:
    """Return how a joint moves a point [m/rad]."""
    z = sign * row(pose.axis, j)
    out = z
    if turns:
        out = wp.cross(z, point - row(pose.origin, j))
    return out


@device_template
def along_routes(
    mechanism: Mechanism, world: int, pose: Pose, drive: Drive, q: JointVector, v: JointVector
) -> Drive:
    """Return a drive with the lengths, arms and velocity terms of all tendons in one posture."""
    arms = mechanism.arms[world]
    length = mechanism.excursion_offset[world] + arms * q
    bow = TendonVector()
    for s in range(wp.static(SPANS)):
        d = wp.static(SPAN_TENDON[s])
        a = path_row(pose.place, wp.static(SPAN_START[s]))
        b = path_row(pose.place, wp.static(SPAN_END[s]))
        terms = span_terms(
            mechanism, world, pose,
            wp.static(SPAN_START[s]), wp.static(SPAN_END[s]), wp.static(SPAN_PULLEY[s]),
        )  # fmt: skip
        length[d] = length[d] - terms.length
        speed_a = Vec3()
        speed_b = Vec3()
        turning_a = Vec3()  # acceleration of an end at q_ddot = 0 [m/s2]
        turning_b = Vec3()
        for j in range(JOINTS):
            if wp.static(START_SIGN[s][j] != 0):
                move = column(
                    pose, j, wp.static(REVOLUTE[j]), real(wp.static(float(START_SIGN[s][j]))), a
                )
                arms[d, j] = arms[d, j] - wp.dot(terms.start, move)
                speed_a = speed_a + move * v[j]
            if wp.static(END_SIGN[s][j] != 0):
                move = column(
                    pose, j, wp.static(REVOLUTE[j]), real(wp.static(float(END_SIGN[s][j]))), b
                )
                arms[d, j] = arms[d, j] - wp.dot(terms.end, move)
                speed_b = speed_b + move * v[j]
        for j in range(JOINTS):
            for k in range(JOINTS):
                if wp.static(START_PAIR[s][j][k]):
                    move = column(
                        pose, k, wp.static(REVOLUTE[k]), real(wp.static(float(START_SIGN[s][k]))), a
                    )
                    twice = real(wp.static(float(START_SIGN[s][j]) * (1.0 + float(j != k))))
                    turning_a = turning_a + wp.cross(row(pose.axis, j), move) * (
                        twice * v[j] * v[k]
                    )
                if wp.static(END_PAIR[s][j][k]):
                    move = column(
                        pose, k, wp.static(REVOLUTE[k]), real(wp.static(float(END_SIGN[s][k]))), b
                    )
                    twice = real(wp.static(float(END_SIGN[s][j]) * (1.0 + float(j != k))))
                    turning_b = turning_b + wp.cross(row(pose.axis, j), move) * (
                        twice * v[j] * v[k]
                    )
        bend = wp.dot(speed_a, terms.start_start * speed_a)
        bend = bend + real(2.0) * wp.dot(speed_a, terms.start_end * speed_b)
        bend = bend + wp.dot(speed_b, terms.end_end * speed_b)
        bend = bend + wp.dot(terms.start, turning_a) + wp.dot(terms.end, turning_b)
        bow[d] = bow[d] - bend
    out = drive
    out.length = length
    out.arms = arms
    out.bow = bow
    return out


@device_template
def route_stiffness(
    mechanism: Mechanism, world: int, pose: Pose, tension: TendonVector
) -> JointMatrix:
    """Return the derivative of the tensions' torque by the joints, T H [N m/rad]."""
    out = JointMatrix()
    for s in range(wp.static(SPANS)):
        pull = tension[wp.static(SPAN_TENDON[s])]
        a = path_row(pose.place, wp.static(SPAN_START[s]))
        b = path_row(pose.place, wp.static(SPAN_END[s]))
        terms = span_terms(
            mechanism, world, pose,
            wp.static(SPAN_START[s]), wp.static(SPAN_END[s]), wp.static(SPAN_PULLEY[s]),
        )  # fmt: skip
        moves_a = SpaceMatrix()
        moves_b = SpaceMatrix()
        for j in range(JOINTS):
            if wp.static(START_SIGN[s][j] != 0):
                move = column(
                    pose, j, wp.static(REVOLUTE[j]), real(wp.static(float(START_SIGN[s][j]))), a
                )
                for i in range(3):
                    moves_a[j, i] = move[i]
            if wp.static(END_SIGN[s][j] != 0):
                move = column(
                    pose, j, wp.static(REVOLUTE[j]), real(wp.static(float(END_SIGN[s][j]))), b
                )
                for i in range(3):
                    moves_b[j, i] = move[i]
        for j in range(JOINTS):
            for k in range(JOINTS):
                if wp.static(
                    (START_SIGN[s][j] != 0 or END_SIGN[s][j] != 0)
                    and (START_SIGN[s][k] != 0 or END_SIGN[s][k] != 0)
                ):
                    a_j = row(moves_a, j)
                    a_k = row(moves_a, k)
                    b_j = row(moves_b, j)
                    b_k = row(moves_b, k)
                    bend = wp.dot(a_j, terms.start_start * a_k + terms.start_end * b_k)
                    bend = bend + wp.dot(a_k, terms.start_end * b_j)
                    bend = bend + wp.dot(b_j, terms.end_end * b_k)
                    out[j, k] = out[j, k] - pull * bend
                if wp.static(START_PAIR[s][j][k]):
                    turned = wp.cross(row(pose.axis, j), row(moves_a, k))
                    bend = real(wp.static(float(START_SIGN[s][j]))) * wp.dot(terms.start, turned)
                    out[j, k] = out[j, k] - pull * bend
                    if wp.static(j != k):
                        out[k, j] = out[k, j] - pull * bend
                if wp.static(END_PAIR[s][j][k]):
                    turned = wp.cross(row(pose.axis, j), row(moves_b, k))
                    bend = real(wp.static(float(END_SIGN[s][j]))) * wp.dot(terms.end, turned)
                    out[j, k] = out[j, k] - pull * bend
                    if wp.static(j != k):
                        out[k, j] = out[k, j] - pull * bend
    return out


@device_template
def located(
    mechanism: Mechanism, world: int, drive: Drive, q: JointVector, v: JointVector
) -> Drive:
    """Return a drive that knows its routed tendons in a posture; all others need no more."""
    out = drive
    if wp.static(ROUTED):
        pose = route_pose(mechanism, world, q)
        out = along_routes(mechanism, world, pose, drive, q, v)
    return out


@device_template
def tendon_arms(mechanism: Mechanism, world: int, drive: Drive) -> ArmMatrix:
    """Return the moment arms [m], shape (D, J), where the drive was located last."""
    arms = mechanism.arms[world]
    if wp.static(ROUTED):
        arms = drive.arms
    return arms


@device_template
def tendon_bow(drive: Drive) -> TendonVector:
    """Return what the tendons accelerate by at q_ddot = 0 [m/s2]; constant arms: nothing."""
    bow = TendonVector()
    if wp.static(ROUTED):
        bow = drive.bow
    return bow
