"""A finger between two strings: one closes it through guides, one opens it over its knuckles."""

from collections.abc import Sequence
from math import acos, cos, sin, sqrt

from tendon_hardware.virtual_bench.physics.constants import AntagonistConstants
from tendon_hardware.virtual_bench.physics.mechanisms import Phalanges


class Crossing:
    r"""A string past one joint, from a guide before the axis to one behind it.

    .. math::
        d = \sqrt{a^2 + b^2 - 2 a b \cos\gamma}, \qquad
        d = \sqrt{a^2 - R^2} + \sqrt{b^2 - R^2} + R\,(\gamma - \arccos(R/a) - \arccos(R/b))

    ``a`` and ``b`` are the guides' distances from the axis and ``gamma`` the angle between them,
    which the joint makes smaller on the palm's side and greater on the back. The second form holds
    where the string lies on a knuckle of radius ``R``: where its bracket is positive.

    Args:
        before: Distance of the first guide [m].
        behind: Distance of the second guide [m].
        angle: Angle between the guides while the finger is straight [rad].
        turn: Change of that angle with the joint's [1]: -1 on the palm's side, +1 on the back.
        knuckle: Radius to the middle of the string [m], 0 where there is no knuckle.
    """

    __slots__ = ("_angle", "_free", "_knuckle", "_product", "_squares", "_touch", "_turn")

    def __init__(
        self, before: float, behind: float, angle: float, turn: float, knuckle: float = 0.0
    ) -> None:
        self._squares = before * before + behind * behind
        self._product = before * behind
        self._angle, self._turn, self._knuckle = angle, turn, knuckle
        self._touch = acos(knuckle / before) + acos(knuckle / behind)
        square = knuckle * knuckle
        self._free = sqrt(before * before - square) + sqrt(behind * behind - square)

    def at(self, q: float) -> tuple[float, float]:
        """Return the string's length past a joint at an angle [m], and its slope [m/rad]."""
        angle = self._angle + self._turn * q
        if self._knuckle > 0.0 and angle > self._touch:
            length = self._free + self._knuckle * (angle - self._touch)
            return length, self._turn * self._knuckle
        length = sqrt(self._squares - 2.0 * self._product * cos(angle))
        return length, self._turn * self._product * sin(angle) / length


class AntagonistFinger(Phalanges):
    """Two phalanges between a flexor and an extensor, in this order wherever there are two."""

    __slots__ = ("_strings", "excursion_rates", "excursions")

    def __init__(self, constants: AntagonistConstants) -> None:
        super().__init__(constants)
        c = constants
        flexor = zip(c.flexor_before, c.flexor_behind, c.flexor_angle, strict=True)
        extensor = zip(
            c.extensor_before, c.extensor_behind, c.extensor_angle, c.knuckles, strict=True
        )
        strings = (
            [Crossing(before, behind, angle, -1.0) for before, behind, angle in flexor],
            [
                Crossing(before, behind, angle, 1.0, knuckle)
                for before, behind, angle, knuckle in extensor
            ],
        )
        self._strings = tuple((mcp, pip, mcp.at(0.0)[0] + pip.at(0.0)[0]) for mcp, pip in strings)
        self.excursions: tuple[float, ...] = (0.0, 0.0)  # Line given to each string [m]
        self.excursion_rates: tuple[float, ...] = (0.0, 0.0)  # [m/s]

    def advance(
        self, pulls: Sequence[float], stiffnesses: Sequence[float], time_step: float
    ) -> None:
        """Advance by one substep [s] under each string's pull [N] and stiffness [N/m]."""
        q1, q2 = self.angles
        t1 = t2 = l11 = l12 = l22 = 0.0
        for (mcp, pip, _), pull, stiffness in zip(self._strings, pulls, stiffnesses, strict=True):
            j1, j2 = -mcp.at(q1)[1], -pip.at(q2)[1]
            line = time_step * time_step * stiffness
            t1 += j1 * pull
            t2 += j2 * pull
            l11 += line * j1 * j1
            l12 += line * j1 * j2
            l22 += line * j2 * j2
        self.move((t1, t2), (l11, l12, l22), time_step)
        (q1, q2), (v1, v2) = self.angles, self.rates
        excursions: list[float] = []
        rates: list[float] = []
        for mcp, pip, straight in self._strings:
            (first, slope1), (second, slope2) = mcp.at(q1), pip.at(q2)
            excursions.append(straight - first - second)
            rates.append(-slope1 * v1 - slope2 * v2)
        self.excursions, self.excursion_rates = tuple(excursions), tuple(rates)
