"""How deep a free body overlaps a fixed obstacle, and in which direction the body is pushed off.

A ball meets everything at its nearest point. A box meets flat faces with its corners, each by
itself, and a fixed box with both boxes' corners: where edges cross, nothing is met.
"""

# The stubs of Warp know no sizes that are set later.
# pyright: reportOperatorIssue=false, reportReturnType=false

from __future__ import annotations

import warp as wp

from tendon_newton.device_code.placeholders import BODY_SHAPE, Mat33, Vec3, real
from tendon_newton.device_code.structs import ContactPose, Overlap, Surface
from tendon_newton.device_code.templates import device_template
from tendon_newton.simulation.contact.contact_distances import BOX, box_surface, surface_at
from tendon_newton.simulation.contact.contact_plan import CENTRE, CORNERS


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
