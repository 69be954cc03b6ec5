r"""Tendons that run through sites and around pulleys: length, moment arms and curvature.

A route is a chain of spans. A free span is the straight line between its two sites. Around a pulley
of radius :math:`r` the string is a geodesic of the cylinder between two tangents. Let :math:`\rho`
be the distance of a site from the pulley's axis and :math:`\varphi` the angle between the two sites
about it. Rolled out flat,

.. math::
    \lambda = s_a + s_b + r (\varphi - \beta_a - \beta_b), \quad
    s = \sqrt{\rho^2 - r^2}, \quad \beta = \arccos(r / \rho), \quad
    L = \sqrt{\lambda^2 + \Delta z^2}

where the string touches, :math:`\varphi > \beta_a + \beta_b`, and it is straight where it does not.
The excursion is :math:`l(q) = l_0 + L(0) - L(q)`, so that winding in is positive.

Source: the geometry is that of MuJoCo's spatial tendons (sites, and cylinders with a side site),
which `tests/mechanisms/test_statics.py` compares. There the side of a pulley is chosen anew
in every posture; here once, which is the same for a string that stays on its side.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from tendon_newton.data.recording import Array
from tendon_newton.mechanisms.geometry.joint_frames import (
    Posture,
    frames_of,
    relative_motion,
    way_between,
)
from tendon_newton.mechanisms.geometry.joints import Joint, ReadOnlyArrays


@dataclass(frozen=True, kw_only=True)
class RouteSite(ReadOnlyArrays):
    """A point of a link that a string runs through without friction."""

    prim: str  # Path of its prim in the asset
    body: int  # Link that carries it; -1 is the base
    point: Array  # Place in that link's frame [m], shape (3,)


@dataclass(frozen=True, kw_only=True)
class Pulley(ReadOnlyArrays):
    """A cylinder that a string is wrapped around, turning freely or not: its surface is smooth."""

    prim: str  # Path of its prim in the asset
    body: int  # Link that carries it; -1 is the base
    point: Array  # Middle of the pulley in that link's frame [m], shape (3,)
    rotation: Array  # From its own frame, with the axis along z, to the link's, shape (3, 3)
    radius: float  # To the middle of the string [m]
    side: Array  # A point of the same link on the side where the string passes [m], shape (3,)
    # +1 where the string goes round counterclockwise about the axis, -1 where clockwise
    turn: float = 1.0


@dataclass(frozen=True, kw_only=True)
class RoutedSpan:
    """A string from one site to the next, around a pulley or straight."""

    start: RouteSite
    end: RouteSite
    pulley: Pulley | None = None

    @property
    def reference(self) -> int:
        """Link from which its ends are looked at: that of the pulley, else of the start."""
        return self.start.body if self.pulley is None else self.pulley.body


@dataclass(frozen=True, kw_only=True)
class Route:
    """The path of one tendon over the joints of a mechanism."""

    joints: tuple[Joint, ...]  # All joints of the mechanism
    spans: tuple[RoutedSpan, ...]  # From the spool to the last site

    @property
    def joint_count(self) -> int:
        """Number of joints J of the mechanism."""
        return len(self.joints)

    @property
    def stops(self) -> tuple[RouteSite | Pulley, ...]:
        """Everything on the path, in its order."""
        found: list[RouteSite | Pulley] = [self.spans[0].start]
        for span in self.spans:
            found += [span.end] if span.pulley is None else [span.pulley, span.end]
        return tuple(found)

    @cached_property
    def rest_length(self) -> float:
        """Length at q = 0 [m]."""
        return self._derivatives(np.zeros(self.joint_count))[0]

    def excursion(self, joint_position: Array) -> Array:
        """Return how much less string there is than at q = 0 [m], shape (...)."""
        return np.apply_along_axis(
            lambda q: np.array(self.rest_length - self._derivatives(q)[0]), -1, joint_position
        )

    def moment_arms(self, joint_position: Array) -> Array:
        """Return the slope of the excursion [m/rad], shape (..., J)."""
        return np.apply_along_axis(lambda q: -self._derivatives(q)[1], -1, joint_position)

    def curvature(self, joint_position: Array) -> Array:
        """Return the slope of the moment arms [m/rad^2] in one posture, shape (J, J)."""
        return -self._derivatives(joint_position)[2]

    def points(self, joint_position: Array) -> Array:
        """Return the string in the base frame [m] for a drawing, shape (N, 3)."""
        frames = frames_of(self.joints, joint_position)
        first = self.spans[0].start
        start = frames.place(first.body, first.point)[None]
        return np.concatenate([start, *(_drawn(span, frames) for span in self.spans)])

    @cached_property
    def _ways(self) -> tuple[tuple[tuple[tuple[int, int], ...], ...], ...]:
        """Joints that move the start and the end of each span, as seen from its reference."""
        parents = tuple(joint.parent for joint in self.joints)
        return tuple(
            tuple(
                way_between(parents, span.reference, site.body) for site in (span.start, span.end)
            )
            for span in self.spans
        )

    def _derivatives(self, joint_position: Array) -> tuple[float, Array, Array]:
        """Return length [m], its gradient (J,) and its second derivatives (J, J)."""
        frames = frames_of(self.joints, joint_position)
        count = self.joint_count
        length, slope, bend = 0.0, np.zeros(count), np.zeros((count, count))
        for span, ways in zip(self.spans, self._ways, strict=True):
            own, gradient, hessian = span_length(*seen_ends(span, frames), span.pulley)
            length += own
            if not any(ways):
                continue
            turned = _frame(span, frames)
            ends = [
                relative_motion(self.joints, frames, way, frames.place(site.body, site.point))
                for way, site in zip(ways, (span.start, span.end), strict=True)
            ]
            first = np.concatenate([motion @ turned for motion, _ in ends], axis=1)
            second = np.concatenate([motion @ turned for _, motion in ends], axis=2)
            slope += first @ gradient
            bend += first @ hessian @ first.T + second @ gradient
        return length, slope, bend


def _frame(span: RoutedSpan, frames: Posture) -> Array:
    """Return the rotation from the frame in which a span is looked at to the world."""
    pulley = span.pulley
    return np.eye(3) if pulley is None else frames.turned(pulley.body, pulley.rotation)


def seen_ends(span: RoutedSpan, frames: Posture) -> tuple[Array, Array]:
    """Return both ends of a span [m] in its pulley's frame; without one, from its start."""
    start = frames.place(span.start.body, span.start.point)
    end = frames.place(span.end.body, span.end.point)
    pulley = span.pulley
    origin = start if pulley is None else frames.place(pulley.body, pulley.point)
    rotation = _frame(span, frames)
    return (start - origin) @ rotation, (end - origin) @ rotation


def wrapped_angle(start: Array, end: Array, pulley: Pulley) -> float:
    """Return over which angle a string touches a pulley [rad]; negative: it passes by."""
    rho = np.array([np.hypot(*start[:2]), np.hypot(*end[:2])])
    if np.any(rho <= pulley.radius):
        return -np.inf
    turned = np.arctan2(end[1], end[0]) - np.arctan2(start[1], start[0])
    # From a quarter turn back to three quarters on: free strings lie below, wrapped ones above.
    angle = (pulley.turn * turned + np.pi / 2.0) % (2.0 * np.pi) - np.pi / 2.0
    return float(angle - np.sum(np.arccos(pulley.radius / rho)))


def span_length(start: Array, end: Array, pulley: Pulley | None) -> tuple[float, Array, Array]:
    """Return a span's length [m], its gradient (6,) and second derivatives (6, 6) by its two ends.

    The ends (3,) [m] are in the pulley's frame, if there is one.
    """
    arc = -1.0 if pulley is None else wrapped_angle(start, end, pulley)
    if pulley is None or arc <= 0.0:
        away = end - start
        length = float(np.linalg.norm(away))
        u = away / length
        block = (np.eye(3) - np.outer(u, u)) / length
        return length, np.concatenate([-u, u]), np.block([[block, -block], [-block, block]])
    flat, slope, bend = pulley.radius * arc, np.zeros(6), np.zeros((6, 6))
    for place, site, outwards in ((0, start, -1.0), (3, end, 1.0)):
        own = slice(place, place + 2)
        tangent, slope[own], bend[own, own] = _tangent(site, pulley, outwards * pulley.turn)
        flat += tangent
    rise = np.array([0.0, 0.0, -1.0, 0.0, 0.0, 1.0])
    height = float(end[2] - start[2])
    length = float(np.hypot(flat, height))
    gradient = (flat * slope + height * rise) / length
    outer = np.outer(slope, slope) + flat * bend + np.outer(rise, rise)
    return length, gradient, (outer - np.outer(gradient, gradient)) / length


def _tangent(site: Array, pulley: Pulley, turn: float) -> tuple[float, Array, Array]:
    """Return the free part of a wrapped string at one end, and how all of it changes there.

    The site (3,) [m] is in the pulley's frame; a turn of +1 winds more string as it moves
    counterclockwise. Returned are the tangent's length [m], and the first (2,) and second
    derivatives (2, 2) of the whole flat length.
    """
    rho, r = float(np.hypot(*site[:2])), pulley.radius
    s = float(np.sqrt(rho**2 - r**2))
    radial = site[:2] / rho
    around = np.array([-radial[1], radial[0]])
    slope = (s / rho) * radial + turn * (r / rho) * around
    mixed = np.outer(radial, around) + np.outer(around, radial)
    bend = (
        r**2 / (s * rho**2) * np.outer(radial, radial)
        + s / rho**2 * np.outer(around, around)
        - turn * r / rho**2 * mixed
    )
    return s, slope, bend


def side_turn(start: Array, end: Array, side: Array, radius: float) -> float:
    """Return which way a string goes round so that its middle is on a side: +1 or -1.

    All points (3,) [m] are in the pulley's frame; the side is a point where the string passes.
    """
    first, last = np.arctan2(start[1], start[0]), np.arctan2(end[1], end[0])
    free = [np.arccos(min(1.0, radius / np.hypot(*site[:2]))) for site in (start, end)]
    towards = []
    for turn in (1.0, -1.0):
        between = (turn * (last - first)) % (2.0 * np.pi)
        middle = first + turn * (between + free[0] - free[1]) / 2.0
        towards.append(side[0] * np.cos(middle) + side[1] * np.sin(middle))
    return 1.0 if towards[0] > towards[1] else -1.0


def _drawn(span: RoutedSpan, frames: Posture) -> Array:
    """Return the points of a span behind its start [m], shape (N, 3)."""
    end = frames.place(span.end.body, span.end.point)[None]
    pulley = span.pulley
    if pulley is None:
        return end
    a, b = seen_ends(span, frames)
    arc = wrapped_angle(a, b, pulley)
    if arc <= 0.0:
        return end
    r = pulley.radius
    reach = np.hypot(*a[:2])
    begin = np.arctan2(a[1], a[0]) + pulley.turn * np.arccos(r / reach)
    angle = begin + pulley.turn * np.linspace(0.0, arc, 24)
    tangents = [np.sqrt(np.hypot(*site[:2]) ** 2 - r**2) for site in (a, b)]
    way = tangents[0] + r * np.linspace(0.0, arc, 24)
    z = a[2] + (b[2] - a[2]) * way / (sum(tangents) + r * arc)
    circle = np.column_stack([r * np.cos(angle), r * np.sin(angle), z])
    origin = frames.place(pulley.body, pulley.point)
    return np.concatenate([origin + circle @ _frame(span, frames).T, end])
