"""How deep a capsule overlaps an obstacle, in which direction it is pushed off, and where.

A link that lies on a flat face has no single closest point: where it is would jump from end to end
as the link tilts, and the force with it. Both ends of a capsule therefore count against a flat
face, each by itself. What lies between them counts against an edge, as far as it is deeper than
both.
"""

# The stubs of Warp know no sizes that are set later.
# pyright: reportOperatorIssue=false, reportReturnType=false

import warp as wp

from tendon_newton.device_code.placeholders import (
    BODY_SHAPE,
    HAS_BOX,
    HAS_PLANE,
    HAS_SPHERE,
    Mat33,
    Vec3,
    real,
)
from tendon_newton.device_code.structs import ContactPose, Overlap, Surface
from tendon_newton.device_code.templates import device_template
from tendon_newton.simulation.contact.contact_plan import BETWEEN, CENTRE, CORNERS, END, SHAPES

SPHERE = SHAPES.index("sphere")
BOX = SHAPES.index("box")
PLANE = SHAPES.index("plane")

ALL = 1.0e6  # More than any depth [m]: an end bears all of it
TINY = 1.0e-12  # A distance [m] too short to have a direction
# Halvings of a capsule's axis that find where it comes closest to a box; one step of Newton's
# method does the rest
HALVINGS = 10
REACH = 0.5**HALVINGS  # Share of the axis that is left then [1]
# Angle between link and face [rad] over which the closest point wanders from end to end
TILT = 0.02
PREFERENCE = 2.0 * TILT  # Slope of the preference for the middle of an axis [1]


@device_template
def sphere_surface(point: Vec3, centre: Vec3, radius: real) -> Surface:
    """Return a point's distance from a sphere, and the direction away from it."""
    out = Surface()
    away = point - centre
    length = wp.max(wp.length(away), real(TINY))
    out.distance = length - radius
    out.normal = away / length
    return out


@device_template
def plane_surface(point: Vec3, place: Vec3, frame: Mat33) -> Surface:
    """Return a point's height over a plane, and the plane's normal."""
    out = Surface()
    out.normal = Vec3(frame[0, 2], frame[1, 2], frame[2, 2])
    out.distance = wp.dot(out.normal, point - place)
    return out


@device_template
def box_surface(point: Vec3, centre: Vec3, frame: Mat33, half: Vec3) -> Surface:
    """Return a point's distance from a box, negative inside, and the direction away from it."""
    local = wp.transpose(frame) * (point - centre)
    nearest = Vec3(
        wp.clamp(local[0], -half[0], half[0]),
        wp.clamp(local[1], -half[1], half[1]),
        wp.clamp(local[2], -half[2], half[2]),
    )
    away = local - nearest
    distance = wp.length(away)
    normal = away / wp.max(distance, real(TINY))
    if distance <= real(TINY):
        distance = wp.abs(local[0]) - half[0]
        normal = Vec3(wp.sign(local[0]), real(0.0), real(0.0))
        if wp.abs(local[1]) - half[1] > distance:
            distance = wp.abs(local[1]) - half[1]
            normal = Vec3(real(0.0), wp.sign(local[1]), real(0.0))
        if wp.abs(local[2]) - half[2] > distance:
            distance = wp.abs(local[2]) - half[2]
            normal = Vec3(real(0.0), real(0.0), wp.sign(local[2]))
    out = Surface()
    out.distance = distance
    out.normal = frame * normal
    return out


@device_template
def surface_at(point: Vec3, place: Vec3, frame: Mat33, size: Vec3, shape: int) -> Surface:
    """Return a point's distance from an obstacle [m], and the direction away from it."""
    out = Surface()
    if wp.static(HAS_SPHERE):
        if shape == wp.static(SPHERE):
            out = sphere_surface(point, place, size[0])
    if wp.static(HAS_BOX):
        if shape == wp.static(BOX):
            out = box_surface(point, place, frame, size)
    if wp.static(HAS_PLANE):
        if shape == wp.static(PLANE):
            out = plane_surface(point, place, frame)
    return out


@device_template
def approach(start: Vec3, end: Vec3, share: real, place: Vec3, frame: Mat33, half: Vec3) -> real:
    """Return how the distance from a box grows along a capsule's axis [1].

    The preference for the middle is as weak as a tilt by `TILT`.
    """
    axis = end - start
    near = box_surface(start + share * axis, place, frame, half)
    middle = real(PREFERENCE) * (share - real(0.5))
    return wp.dot(near.normal, axis) / wp.length(axis) + middle


@device_template
def halved_share(start: Vec3, end: Vec3, place: Vec3, frame: Mat33, half: Vec3) -> real:
    """Return about where a capsule's axis comes closest to a box, 0 to 1 along it.

    The distance is convex along a line, so that its slope changes sign once.
    """
    low = real(0.0)
    high = real(1.0)
    for _halving in range(wp.static(HALVINGS)):
        middle = real(0.5) * (low + high)
        if approach(start, end, middle, place, frame, half) > real(0.0):
            high = middle
        else:
            low = middle
    return real(0.5) * (low + high)


@device_template
def constant_share(
    start: Vec3, end: Vec3, place: Vec3, frame: Mat33, half: Vec3, adj_ret: real
) -> None:
    """Give no derivative: Newton's step after it has that of the closest point."""


@device_template
def box_share(start: Vec3, end: Vec3, place: Vec3, frame: Mat33, half: Vec3) -> real:
    """Return where a capsule's axis comes closest to a box, 0 to 1 along it."""
    rough = halved_share(start, end, place, frame, half)
    axis = end - start
    local = wp.transpose(frame) * (start + rough * axis - place)
    along = wp.transpose(frame) * axis
    away = local - Vec3(
        wp.clamp(local[0], -half[0], half[0]),
        wp.clamp(local[1], -half[1], half[1]),
        wp.clamp(local[2], -half[2], half[2]),
    )
    outside = Vec3(
        wp.where(away[0] == real(0.0), real(0.0), along[0]),
        wp.where(away[1] == real(0.0), real(0.0), along[1]),
        wp.where(away[2] == real(0.0), real(0.0), along[2]),
    )
    bend = real(PREFERENCE)
    length = wp.length(away)
    if length > real(TINY):
        rise = wp.dot(away, outside) / length
        turning = wp.dot(outside, outside) - rise * rise
        bend = bend + turning / (length * wp.length(axis))
    slope = approach(start, end, rough, place, frame, half)
    reach = real(REACH)
    fine = wp.clamp(rough - slope / bend, rough - reach, rough + reach)
    return real(wp.clamp(fine, real(0.0), real(1.0)))


@device_template
def sphere_share(start: Vec3, end: Vec3, centre: Vec3) -> real:
    """Return where a capsule's axis comes closest to a point, 0 to 1 along it."""
    axis = end - start
    share = wp.dot(centre - start, axis) / wp.dot(axis, axis)
    return real(wp.clamp(share, real(0.0), real(1.0)))


@device_template
def overlap_at(
    start: Vec3,
    end: Vec3,
    radius: real,
    spot: int,
    place: Vec3,
    frame: Mat33,
    size: Vec3,
    shape: int,
) -> Overlap:
    """Return the overlap of a capsule and an obstacle in one of the capsule's spots."""
    share = real(0.0)
    if spot == wp.static(END):
        share = real(1.0)
    if wp.static(HAS_SPHERE):
        if shape == wp.static(SPHERE):
            share = sphere_share(start, end, place)
    shallow = real(0.0)  # what the ends of an axis bear already
    if wp.static(HAS_BOX):
        if shape == wp.static(BOX) and spot == wp.static(BETWEEN):
            share = box_share(start, end, place, frame, size)
            first = box_surface(start, place, frame, size)
            last = box_surface(end, place, frame, size)
            shallow = wp.max(radius - wp.min(first.distance, last.distance), real(0.0))
            if share <= real(0.0) or share >= real(1.0):
                shallow = real(ALL)
    point = start + share * (end - start)
    near = surface_at(point, place, frame, size, shape)
    out = Overlap()
    out.depth = radius - near.distance - shallow
    out.normal = near.normal
    out.point = point - real(0.5) * (radius + near.distance) * near.normal
    return out


@device_template
def corner(number: int, place: Vec3, frame: Mat33, half: Vec3) -> Vec3:
    """Return a corner of a box."""
    local = half
    for axis in range(3):
        if ((number >> axis) & 1) == 0:
            local[axis] = -half[axis]
    return place + frame * local


@device_template
def met(point: Vec3, radius: real, near: Surface, side: real) -> Overlap:
    """Return how deep a ball about a point is in a surface.

    A corner has the radius 0 [m]; the side is +1 where the ball is the body's, -1 where the surface
    is.
    """
    out = Overlap()
    out.depth = radius - near.distance
    out.normal = side * near.normal
    out.point = point - real(0.5) * (radius + near.distance) * near.normal
    return out


@device_template
def rest_overlap(
    pose: ContactPose, body: Vec3, spot: int, place: Vec3, frame: Mat33, size: Vec3, shape: int
) -> Overlap:
    """Return the overlap of a body of some size and a fixed obstacle in one of its spots."""
    out = Overlap()
    if wp.static(BODY_SHAPE == BOX):
        if spot < wp.static(CORNERS):
            point = corner(spot, pose.body_place, pose.body_frame, body)
            near = surface_at(point, place, frame, size, shape)
            out = met(point, real(0.0), near, real(1.0))
        else:
            point = place
            radius = size[0]
            if spot < wp.static(CENTRE):
                point = corner(spot - wp.static(CORNERS), place, frame, size)
                radius = real(0.0)
            near = box_surface(point, pose.body_place, pose.body_frame, body)
            out = met(point, radius, near, -real(1.0))
    else:
        near = surface_at(pose.body_place, place, frame, size, shape)
        out = met(pose.body_place, body[0], near, real(1.0))
    return out
