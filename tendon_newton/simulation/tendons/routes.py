r"""Routed tendons on the device: length, moment arms and curvature.

`mechanisms.geometry.routing` has the same equations in numpy.

A span is described in the frame of one link, its *observer*: the link of its pulley, or of its
start. Only the joints between the observer and the span's ends move the span. `START_WAY` and
`END_WAY` name these joints by their place on the way from the observer to an end, counted from 1.
The place is negative for a joint that carries the observer, and 0 for all other joints.

The equations of motion need three things of a tendon whose arms :math:`A(q) = dl/dq` are not
constant, all from the second derivatives :math:`H` of the excursion :math:`l(q)`: its acceleration
:math:`\ddot l = A \ddot q + \dot q^T H \dot q`, the torque of a rotor that it turns, and the
geometric stiffness :math:`T H` of a tension :math:`T`.
"""

# The stubs of Warp know no sizes that are set later.
# pyright: reportOperatorIssue=false, reportReturnType=false

import warp as wp

from tendon_newton.device_code.placeholders import (
    END_WAY,
    FIRST_SPAN,
    FREE_SPOOL,
    LINKS,
    REVOLUTE,
    ROUTED,
    ROWS,
    SPAN_TABLE,
    START_WAY,
    TENDONS,
    ArmMatrix,
    BendMatrix,
    JointMatrix,
    JointVector,
    LinkMatrix,
    RowMatrix,
    RowVector,
    SpaceMatrix,
    TendonVector,
    Vec3,
    WayVector,
    real,
)
from tendon_newton.device_code.slots import all_routes
from tendon_newton.device_code.structs import (
    ContactStates,
    Drive,
    JointPose,
    Mechanism,
    Routes,
    RouteTerms,
    SpanTerms,
)
from tendon_newton.device_code.templates import device_template
from tendon_newton.simulation.chains.joint_poses import joint_pose, moved_by
from tendon_newton.simulation.chains.spatial_chain import row
from tendon_newton.simulation.tendons.spans import point_place, span_terms


@device_template
def sign_of(place: int) -> real:
    """Return +1 for a joint that carries a span's end, -1 if it carries the observer, else 0."""
    sign = real(0.0)
    if place > 0:
        sign = real(1.0)
    if place < 0:
        sign = real(-1.0)
    return sign


@device_template
def turn_sign(turning: int, moving: int) -> real:
    """Return the sign with which a joint turns how another moves an end; 0: it does not.

    It does where it lies before the other on the way, or is the other.
    """
    sign = real(0.0)
    if moving != 0 and wp.abs(turning) <= wp.abs(moving):
        sign = sign_of(turning)
    return sign


@device_template
def end_moves(pose: JointPose, way: WayVector, point: Vec3) -> SpaceMatrix:
    """Return how joints move an end of a span, as seen by the observer [m/rad], shape (J, 3)."""
    moves = SpaceMatrix()
    for j in range(LINKS):
        if way[j] != 0:
            move = sign_of(way[j]) * moved_by(
                row(pose.origin, j), row(pose.axis, j), wp.static(REVOLUTE[j]), point
            )
            for i in range(3):
                moves[j, i] = move[i]
    return moves


@device_template
def end_turning(pose: JointPose, way: WayVector, slope: Vec3, moves: SpaceMatrix) -> LinkMatrix:
    """Return what an end gives a length's second derivatives as its moves turn, shape (L, L).

    `way` has the places of the joints on the way to the end, `slope` the length's derivative by it
    [1], and `moves` how the joints move it [m/rad].
    """
    out = LinkMatrix()
    for j in range(LINKS):
        for k in range(LINKS):
            sign = turn_sign(way[j], way[k])
            if wp.static(REVOLUTE[j]):
                if sign != real(0.0):
                    turned = wp.cross(row(pose.axis, j), row(moves, k))
                    bend = sign * wp.dot(slope, turned)
                    out[j, k] = out[j, k] + bend
                    if wp.static(j != k):
                        out[k, j] = out[k, j] + bend
    return out


@device_template
def span_bend(terms: SpanTerms, start: Vec3, end: Vec3, other_start: Vec3, other_end: Vec3) -> real:
    """Return a length's second derivative by two moves of both ends of its span [m]."""
    bend = wp.dot(start, terms.start_start * other_start + terms.start_end * other_end)
    return (
        bend + wp.dot(other_start, terms.start_end * end) + wp.dot(end, terms.end_end * other_end)
    )


@device_template
def span_route(mechanism: Mechanism, world: int, pose: JointPose, span: int) -> RouteTerms:
    """Return the length of one span [m], and its derivatives by the joints."""
    start = point_place(mechanism, world, pose, SPAN_TABLE[span, 0])
    end = point_place(mechanism, world, pose, SPAN_TABLE[span, 1])
    terms = span_terms(mechanism, world, pose, start, end, SPAN_TABLE[span, 2])
    start_way = START_WAY[span]
    end_way = END_WAY[span]
    starts = end_moves(pose, start_way, start)
    ends = end_moves(pose, end_way, end)
    slope = JointVector()
    bend = end_turning(pose, start_way, terms.start, starts)
    bend = bend + end_turning(pose, end_way, terms.end, ends)
    for j in range(LINKS):
        if start_way[j] != 0 or end_way[j] != 0:
            a = row(starts, j)
            b = row(ends, j)
            slope[j] = wp.dot(terms.start, a) + wp.dot(terms.end, b)
            for k in range(LINKS):
                if start_way[k] != 0 or end_way[k] != 0:
                    bend[j, k] = bend[j, k] + span_bend(terms, a, b, row(starts, k), row(ends, k))
    out = RouteTerms()
    out.length = terms.length
    out.slope = slope
    out.bend = bend
    return out


@device_template
def unrolled_routes(mechanism: Mechanism, world: int, pose: JointPose) -> Routes:
    """Return the lengths of all tendons' spans and their derivatives by the joints, span by span.

    A compiler that inlines them sees which joints move which, and leaves out all others.
    """
    out = Routes()
    length = TendonVector()
    slope = ArmMatrix()
    bend = BendMatrix()
    for d in range(TENDONS):
        for span in range(wp.static(FIRST_SPAN[d]), wp.static(FIRST_SPAN[d + 1])):
            own = span_route(mechanism, world, pose, span)
            length[d] = length[d] + own.length
            for j in range(LINKS):
                slope[d, j] = slope[d, j] + own.slope[j]
                for k in range(LINKS):
                    bend[LINKS * d + j, k] = bend[LINKS * d + j, k] + own.bend[j, k]
    out.length = length
    out.slope = slope
    out.bend = bend
    return out


@device_template
def summed_spans(
    mechanism: Mechanism, world: int, pose: JointPose, first: int, last: int
) -> RouteTerms:
    """Return the length of some spans [m], and its derivatives by the joints.

    A loop that stays one: a tape needs no state of a sum to walk it back.
    """
    length = real(0.0)
    slope = JointVector()
    bend = LinkMatrix()
    for span in range(first, last):
        own = span_route(mechanism, world, pose, span)
        length = length + own.length
        slope = slope + own.slope
        bend = bend + own.bend
    out = RouteTerms()
    out.length = length
    out.slope = slope
    out.bend = bend
    return out


@device_template
def looped_routes(mechanism: Mechanism, world: int, pose: JointPose) -> Routes:
    """Return `unrolled_routes` where a tape walks back: in a quarter of the time to compile."""
    out = Routes()
    length = TendonVector()
    slope = ArmMatrix()
    bend = BendMatrix()
    for d in range(TENDONS):
        own = summed_spans(
            mechanism, world, pose, wp.static(FIRST_SPAN[d]), wp.static(FIRST_SPAN[d + 1])
        )
        length[d] = own.length
        for j in range(LINKS):
            slope[d, j] = own.slope[j]
            for k in range(LINKS):
                bend[LINKS * d + j, k] = own.bend[j, k]
    out.length = length
    out.slope = slope
    out.bend = bend
    return out


@device_template
def placed(drive: Drive, q: JointVector, v: JointVector) -> Drive:
    """Return a drive that knows where its world is, and of its routed tendons nothing."""
    out = drive
    out.q = q
    out.v = v
    return out


@device_template
def located(mechanism: Mechanism, drive: Drive, q: JointVector, v: JointVector) -> Drive:
    """Return a drive that knows where its world is, and how its routed tendons run there."""
    out = placed(drive, q, v)
    if wp.static(ROUTED):
        arms = mechanism.arms[drive.world]
        pose = joint_pose(mechanism, drive.world, q)
        routes = all_routes(mechanism, drive.world, pose)
        bow = TendonVector()
        for d in range(TENDONS):
            for j in range(LINKS):
                for k in range(LINKS):
                    bow[d] = bow[d] - v[j] * routes.bend[LINKS * d + j, k] * v[k]
        out.length = mechanism.excursion_offset[drive.world] + arms * q - routes.length
        out.arms = arms - routes.slope
        out.bow = bow
        out.bend = -routes.bend
    return out


@device_template
def route_stiffness(here: Drive, tension: TendonVector) -> JointMatrix:
    """Return the derivative of the tensions' torque by the joints, T H [N m/rad]."""
    out = JointMatrix()
    for d in range(TENDONS):
        for j in range(LINKS):
            for k in range(LINKS):
                out[j, k] = out[j, k] + tension[d] * here.bend[LINKS * d + j, k]
    return out


@device_template
def tendon_arms(mechanism: Mechanism, here: Drive) -> ArmMatrix:
    """Return the moment arms [m], shape (D, J)."""
    arms = mechanism.arms[here.world]
    if wp.static(ROUTED):
        arms = here.arms
    return arms


@device_template
def tendon_bow(here: Drive) -> TendonVector:
    """Return what the tendons accelerate by at q_ddot = 0 [m/s2]; constant arms: nothing."""
    bow = TendonVector()
    if wp.static(ROUTED):
        bow = here.bow
    return bow


@device_template
def row_arms(mechanism: Mechanism, here: Drive, contact: ContactStates) -> RowMatrix:
    """Return the rows in which dry friction acts on tendons [m] or [1], shape (R, J).

    A spool that its string holds fast moves with its mechanism alone.
    """
    arms = tendon_arms(mechanism, here)
    if wp.static(FREE_SPOOL):
        rows = RowMatrix()
        for d in range(TENDONS):
            for j in range(LINKS):
                rows[d, j] = arms[d, j]
                rows[TENDONS + d, j] = arms[d, j]
            rows[d, LINKS + d] = real(1.0) - contact.joint_held[LINKS + d]
        return rows
    else:
        return arms


@device_template
def row_bow(here: Drive) -> RowVector:
    """Return what the rows accelerate by at q_ddot = 0 [m/s2]."""
    bow = RowVector()
    if wp.static(ROUTED):
        for r in range(ROWS):
            bow[r] = here.bow[wp.static(r % TENDONS)]
    return bow
