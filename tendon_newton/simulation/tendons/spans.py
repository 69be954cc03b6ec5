"""One span of a routed tendon, straight or around a pulley.

`mechanisms.geometry.routing` has the same equations in numpy.
"""

# The stubs of Warp know no sizes that are set later.
# pyright: reportOperatorIssue=false, reportReturnType=false

import warp as wp

from tendon_newton.device_code.placeholders import POINT_BODY, Mat33, Vec3, real
from tendon_newton.device_code.structs import JointPose, Mechanism, SpanTerms
from tendon_newton.device_code.templates import device_template
from tendon_newton.simulation.chains.spatial_chain import row, turn_of

# A string that passes its pulley freely spans less than nothing of it, down to this [rad]
QUARTER = 0.5 * wp.pi
TURN = 2.0 * wp.pi


@device_template
def point_place(mechanism: Mechanism, world: int, pose: JointPose, point: int) -> Vec3:
    """Return where a point of a path is, in the axes of the base [m]."""
    place = mechanism.path_point[world, point]
    body = POINT_BODY[point]
    if body >= 0:
        place = row(pose.origin, body) + turn_of(pose.rotation, body) * place
    return place


@device_template
def pulley_frame(mechanism: Mechanism, world: int, pose: JointPose, pulley: int) -> Mat33:
    """Return how a pulley is turned: its axes as columns."""
    frame = mechanism.path_frame[world, pulley]
    body = POINT_BODY[pulley]
    if body >= 0:
        frame = turn_of(pose.rotation, body) * frame
    return frame


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
        wp.outer(slope_a, slope_a)
        + flat * rolled_bend(a, rho_a, free_a, radius, -turn)
        + lift
        - wp.outer(terms.start, terms.start)
    ) / length
    terms.start_end = (
        wp.outer(slope_a, slope_b) - lift - wp.outer(terms.start, terms.end)
    ) / length
    terms.end_end = (
        wp.outer(slope_b, slope_b)
        + flat * rolled_bend(b, rho_b, free_b, radius, turn)
        + lift
        - wp.outer(terms.end, terms.end)
    ) / length
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
    mechanism: Mechanism, world: int, pose: JointPose, a: Vec3, b: Vec3, pulley: int
) -> SpanTerms:
    """Return a span in the axes of the base: its length [m] and its derivatives by both ends."""
    terms = SpanTerms()
    arc = real(-1.0)
    if pulley >= 0:
        centre = point_place(mechanism, world, pose, pulley)
        frame = pulley_frame(mechanism, world, pose, pulley)
        back = wp.transpose(frame)
        own_a = back * (a - centre)
        own_b = back * (b - centre)
        radius = mechanism.path_radius[world, pulley]
        turn = mechanism.path_turn[world, pulley]
        arc = wrapped_angle(own_a, own_b, radius, turn)
        if arc > real(0.0):
            own = wrapped_span(own_a, own_b, arc, radius, turn)
            terms.length = own.length
            terms.start = frame * own.start
            terms.end = frame * own.end
            terms.start_start = frame * own.start_start * back
            terms.start_end = frame * own.start_end * back
            terms.end_end = frame * own.end_end * back
    if arc <= real(0.0):
        terms = free_span(b - a)
    return terms
