"""Plain Python in which device code runs as it stands in the catalogue."""

from __future__ import annotations

import math
from typing import Any

from tendon_newton.exports.runtime.facts import MEMORY_SIZE

real = float
ParameterVector = list


def MemoryVector(value: float) -> list[float]:  # noqa: N802 - the name of Warp's type
    """Return a memory in which every number is the same."""
    return [value] * MEMORY_SIZE


class Jet(tuple):
    """A signal with its derivatives by position and by velocity."""

    __slots__ = ()

    def __new__(cls, value: Any = 0.0, by_position: Any = 0.0, by_velocity: Any = 0.0) -> Jet:
        """Take the three numbers."""
        return tuple.__new__(cls, (value, by_position, by_velocity))

    def __add__(self, other: Any) -> Jet:
        """Add a jet."""
        return Jet(self[0] + other[0], self[1] + other[1], self[2] + other[2])

    def __sub__(self, other: Any) -> Jet:
        """Subtract a jet."""
        return Jet(self[0] - other[0], self[1] - other[1], self[2] - other[2])

    def __neg__(self) -> Jet:
        """Change the sign."""
        return Jet(-self[0], -self[1], -self[2])

    def __mul__(self, factor: Any) -> Jet:
        """Multiply by a number."""
        return Jet(self[0] * factor, self[1] * factor, self[2] * factor)

    __rmul__ = __mul__

    def __truediv__(self, divisor: Any) -> Jet:
        """Divide by a number."""
        return self * (1.0 / divisor)


class Struct:
    """Numbers that travel together; device code copies them where it gives them another name."""

    def copy(self) -> Any:
        """Return the same numbers, to be changed alone."""
        other = object.__new__(type(self))
        other.__dict__.update(self.__dict__)
        return other


class wp:  # noqa: N801 - the name under which device code calls it
    """The functions of Warp that device code calls."""

    abs = staticmethod(abs)
    min = staticmethod(min)
    max = staticmethod(max)
    exp = staticmethod(math.exp)
    log = staticmethod(math.log)
    pow = staticmethod(math.pow)
    sin = staticmethod(math.sin)
    cos = staticmethod(math.cos)
    sqrt = staticmethod(math.sqrt)
    isinf = staticmethod(math.isinf)

    @staticmethod
    def sign(x: float) -> float:
        """Return the sign of a number, 1 of zero, as Warp does."""
        return -1.0 if x < 0.0 else 1.0

    @staticmethod
    def clamp(x: float, low: float, high: float) -> float:
        """Return a number inside two bounds."""
        return min(max(x, low), high)
