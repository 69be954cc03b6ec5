"""Links against links: where two capsules come closest, and how joints move one past the other.

Two capsules that lie along each other have no single closest point: where it is would jump from
end to end as one of them tilts, and the force with it. The middles are therefore preferred, as
weakly as by a tilt of `TILT`, and only as far as the angle between both axes leaves the place open.
"""

# The stubs of Warp know no sizes that are set later.
# pyright: reportOperatorIssue=false, reportReturnType=false

import warp as wp

from tendon_newton.device_code.placeholders import (
    CARRIES,
    JOINTS,
    MET_CAPSULE,
    REVOLUTE,
    SpaceMatrix,
    Vec2,
    Vec3,
    real,
)
from tendon_newton.device_code.structs import ContactPose, Mechanism, Overlap
from tendon_newton.device_code.templates import device_template
from tendon_newton.simulation.chains.joint_poses import moved_by
from tendon_newton.simulation.chains.spatial_chain import row
from tendon_newton.simulation.contact.contact_distances import TILT, sphere_surface
from tendon_newton.simulation.contact.contact_poses import end_of


@device_template
def nearest_shares(apart: Vec3, axis: Vec3, other: Vec3, reach: real) -> Vec2:
    """Return where two capsules' axes come closest, 0 to 1 along each.

    The squared distance, with the preference for the middles, is a quadratic form. Its least value
    within the square of both shares has the first of them free, or follows from the second's.
    `apart` leads from the start of the second axis to that of the first [m]; at `reach` [m] both
    touch.
    """
    long = wp.dot(axis, axis)
    wide = wp.dot(other, other)
    along = wp.dot(axis, other)
    crossing = real(1.0) - along * along / (long * wide)
    lean = real(TILT) * reach / wp.min(wp.length(axis), wp.length(other)) - crossing
    lean = wp.max(lean, real(0.0))
    first = (real(1.0) + lean) * long
    second = (real(1.0) + lean) * wide
    pull = real(0.5) * lean * long - wp.dot(apart, axis)
    push = real(0.5) * lean * wide + wp.dot(apart, other)
    free = (pull * second + along * push) / (first * second - along * along)
    free = wp.clamp(free, real(0.0), real(1.0))
    met = wp.clamp((push + along * free) / second, real(0.0), real(1.0))
    share = wp.clamp((pull + along * met) / first, real(0.0), real(1.0))
    return Vec2(share, met)


@device_template
def link_overlap(
    mechanism: Mechanism, world: int, pose: ContactPose, capsule: int, obstacle: int
) -> Overlap:
    """Return the overlap of a capsule and the one that an obstacle is."""
    met = MET_CAPSULE[obstacle]
    start = end_of(pose.start, capsule)
    axis = end_of(pose.end, capsule) - start
    begin = end_of(pose.start, met)
    other = end_of(pose.end, met) - begin
    radius = mechanism.capsule_radius[world, capsule]
    met_radius = mechanism.capsule_radius[world, met]
    shares = nearest_shares(start - begin, axis, other, radius + met_radius)
    point = start + shares[0] * axis
    near = sphere_surface(point, begin + shares[1] * other, met_radius)
    out = Overlap()
    out.depth = radius - near.distance
    out.normal = near.normal
    out.point = point - real(0.5) * (radius + near.distance) * near.normal
    return out


@device_template
def past_link(pose: ContactPose, columns: SpaceMatrix, met: int, point: Vec3) -> SpaceMatrix:
    """Return how the coordinates move a link past another at a point, shape (J, 3).

    `columns` say how they move the first one; the link that is met is -1 where the obstacle is
    none.
    """
    moves = SpaceMatrix()
    if met >= 0:
        for j in range(JOINTS):
            move = CARRIES[j, met] * moved_by(
                row(pose.origin, j), row(pose.axis, j), wp.static(REVOLUTE[j]), point
            )
            for i in range(3):
                moves[j, i] = move[i]
    return columns - moves
