"""Mechanisms that the tendon pulls: a carriage on a rail, or a finger with flexible joints."""

from collections.abc import Sequence
from math import cos, sin
from typing import Protocol

from tendon_hardware.virtual_bench.physics.constants import (
    AntagonistConstants,
    FingerConstants,
    SliderConstants,
)


class BenchMechanism(Protocol):
    """A mechanism that gives line when it is pulled."""

    excursion: float  # Line given [m]
    excursion_rate: float  # Rate of the excursion [m/s]

    def advance(self, pull: float, stiffness: float, time_step: float) -> None:
        """Advance by one substep [s] under a pull [N], implicit in what pulls [N/m]."""

    def tip(self) -> tuple[float, float] | None:
        """Return the tip's x and z [m], or ``None`` where there is no tip."""
        ...


class StringMechanism(Protocol):
    """A mechanism that several strings pull."""

    excursions: tuple[float, ...]  # Line given to each string [m]
    excursion_rates: tuple[float, ...]  # [m/s]

    def advance(
        self, pulls: Sequence[float], stiffnesses: Sequence[float], time_step: float
    ) -> None:
        """Advance by one substep [s] under each string's pull [N] and stiffness [N/m]."""

    def tip(self) -> tuple[float, float] | None:
        """Return the tip's x and z [m], or ``None`` where there is no tip."""
        ...


class Slider:
    r"""Carriage against a spring, with dry friction of the rail and one-sided stops.

    .. math:: m \dot v = T - k x - c v - f, \qquad |f| \le f_r
    """

    __slots__ = ("_constants", "excursion", "excursion_rate")

    def __init__(self, constants: SliderConstants) -> None:
        self._constants = constants
        self.excursion = 0.0
        self.excursion_rate = 0.0

    def advance(self, pull: float, stiffness: float, time_step: float) -> None:
        """Advance by one substep, implicit in spring, damping and stops."""
        c, h = self._constants, time_step
        x, v = self.excursion, self.excursion_rate
        k, d = c.stiffness, c.damping
        push = pull - k * x
        depth = x - c.travel if x > c.travel else x if x < 0.0 else 0.0
        if depth and depth * (c.stop_stiffness * depth + c.stop_damping * v) > 0.0:  # never pulls
            push -= c.stop_stiffness * depth
            k += c.stop_stiffness
            d += c.stop_damping
        mass = c.mass + h * (d + h * (k + stiffness))
        free = (c.mass * v + h * push) / mass
        stop = h * c.rail_friction / mass
        v = free - stop if free > stop else free + stop if free < -stop else 0.0
        self.excursion_rate = v
        self.excursion = x + h * v

    def tip(self) -> None:
        """Return nothing: a carriage has no tip."""
        return None


class Phalanges:
    r"""Two phalanges in a vertical plane on joints of TPU, under the torques of tendons.

    .. math::
        M(q) \dot v + c(q, v) = \tau - K q - \chi - D v + g(q) + \tau_{pad} + \tau_{stop}, \qquad
        \dot\chi = \gamma K v - \chi / t_\gamma

    ``tau`` is what tendons give, ``chi`` the Maxwell branch beside each spring. Pads meet shortly
    before the stops, so closure is soft at first. Springs, damping, stops and the lines' stiffness
    are implicit.
    """

    __slots__ = ("_gravity", "_inertias", "_leans", "_links", "angles", "branches", "rates")

    def __init__(self, constants: FingerConstants | AntagonistConstants) -> None:
        self._links = constants
        (l1, l2), (m1, m2) = constants.lengths, constants.masses
        outer = m2 * l2 * l2 / 3.0
        inner = m1 * l1 * l1 / 3.0 + m2 * l1 * l1 + outer
        self._inertias = (inner, outer, 0.5 * m2 * l1 * l2)  # the last by the cosine of the bend
        self._leans = (0.5 * m1 * l1 + m2 * l1, 0.5 * m2 * l2)  # mass by its lever [kg m]
        g = constants.gravity
        self._gravity = (g * cos(constants.tilt), g * sin(constants.tilt))
        self.angles = (0.0, 0.0)
        self.rates = (0.0, 0.0)
        self.branches = (0.0, 0.0)

    def move(
        self, torque: tuple[float, float], line: tuple[float, float, float], time_step: float
    ) -> None:
        """Advance by one substep [s].

        Args:
            torque: Torque of the tendons on both joints [N m].
            line: What stretches against it within the substep, h^2 k j_i j_k for 11, 12, 22
                [kg m^2].
            time_step: The substep [s].
        """
        c, h = self._links, time_step
        q1, q2 = self.angles
        v1, v2 = self.rates
        straight, a22, cross = self._inertias
        bend = cross * cos(q2)
        a12 = a22 + bend
        a11 = straight + 2.0 * bend
        spin = cross * sin(q2)
        down, along = self._gravity
        inner, outer = self._leans
        # the tip points along (cos q, -sin q): weight closes the finger while it lies flat
        weight2 = outer * (down * cos(q1 + q2) - along * sin(q1 + q2))
        weight1 = inner * (down * cos(q1) - along * sin(q1)) + weight2

        t1, k1, d1 = self._joint(0, q1, v1)
        t2, k2, d2 = self._joint(1, q2, v2)
        x1, x2 = self.branches
        fade = 1.0 / (1.0 + h / c.maxwell_time)
        s1 = c.maxwell_ratio * c.stiffness[0] * fade
        s2 = c.maxwell_ratio * c.stiffness[1] * fade
        t1 += torque[0] + weight1 - x1 * fade + spin * (2.0 * v1 + v2) * v2
        t2 += torque[1] + weight2 - x2 * fade - spin * v1 * v1

        b11 = a11 + h * (d1 + h * k1 + s1 * h) + line[0]
        b12 = a12 + line[1]
        b22 = a22 + h * (d2 + h * k2 + s2 * h) + line[2]
        p1 = a11 * v1 + a12 * v2 + h * t1
        p2 = a12 * v1 + a22 * v2 + h * t2
        scale = 1.0 / (b11 * b22 - b12 * b12)
        v1 = (b22 * p1 - b12 * p2) * scale
        v2 = (b11 * p2 - b12 * p1) * scale
        self.rates = (v1, v2)
        self.branches = (x1 * fade + s1 * h * v1, x2 * fade + s2 * h * v2)
        q1 += h * v1
        q2 += h * v2
        self.angles = (q1, q2)

    def _joint(self, k: int, q: float, v: float) -> tuple[float, float, float]:
        """Return a joint's passive torque without damping [N m], its stiffness and damping."""
        c = self._links
        stiffness, damping = c.stiffness[k], c.damping[k]
        torque = -stiffness * q
        limit = c.limits[k]
        meet = q - limit + c.pad_reach
        if meet > 0.0:
            torque -= c.pad_stiffness * meet
            stiffness += c.pad_stiffness
        depth = q - limit if q > limit else q if q < 0.0 else 0.0
        if depth and depth * (c.stop_stiffness * depth + c.stop_damping[k] * v) > 0.0:
            torque -= c.stop_stiffness * depth
            stiffness += c.stop_stiffness
            damping += c.stop_damping[k]
        return torque, stiffness, damping

    def tip(self) -> tuple[float, float]:
        """Return the tip's x and z [m] from the PIP axis."""
        (l1, l2), (q1, q2) = self._links.lengths, self.angles
        return (l1 * cos(q1) + l2 * cos(q1 + q2), -l1 * sin(q1) - l2 * sin(q1 + q2))


class Finger(Phalanges):
    """Two phalanges that one tendon closes, over pulleys at the joints."""

    __slots__ = ("_arms", "excursion", "excursion_rate")

    def __init__(self, constants: FingerConstants) -> None:
        super().__init__(constants)
        self._arms = constants.moment_arms
        self.excursion = 0.0
        self.excursion_rate = 0.0

    def advance(self, pull: float, stiffness: float, time_step: float) -> None:
        """Advance by one substep."""
        j1, j2 = self._arms
        line = time_step * time_step * stiffness
        lines = (line * j1 * j1, line * j1 * j2, line * j2 * j2)
        self.move((j1 * pull, j2 * pull), lines, time_step)
        (q1, q2), (v1, v2) = self.angles, self.rates
        self.excursion = j1 * q1 + j2 * q2
        self.excursion_rate = j1 * v1 + j2 * v2
