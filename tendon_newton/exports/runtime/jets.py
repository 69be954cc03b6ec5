"""Plain Python in which the code of effects runs as it stands in the catalogue."""

from __future__ import annotations

import math
from typing import Any, NamedTuple, SupportsFloat

real = float
Values = tuple


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


class wp:  # noqa: N801 - the name under which the effects call it
    """The functions of Warp that effects call."""

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

    @staticmethod
    def static(x: Any) -> Any:
        """Return what Warp would know when it compiles."""
        return x


def clip(signal: Jet, lower: SupportsFloat, upper: SupportsFloat) -> Jet:
    """Limit a jet; beyond a bound its derivatives vanish."""
    if signal[0] < float(lower):
        return Jet(lower)
    if signal[0] > float(upper):
        return Jet(upper)
    return signal


class Piece(NamedTuple):
    """One effect in one stage."""

    function: Any
    values: tuple[float, ...]
    """Its parameters, padded to three."""
    memory: int = -1
    """Where what it remembers stands, -1 where it remembers nothing."""
    second: int = -1
    """The same of the second of two numbers."""
    place: int = -1
    """Where the result goes of a function that renews a memory."""


def own_values(piece: Piece, memory: Any) -> tuple[float, ...]:
    """Return an effect's parameters and what it remembers; nobody's memory is empty."""
    if memory is None or piece.memory < 0:
        return (*piece.values, 0.0, 0.0)
    second = memory[piece.second] if piece.second >= 0 else 0.0
    return (*piece.values, memory[piece.memory], second)


def staged(signal: Any, pieces: list[Piece], *arguments: Any, memory: Any = None) -> Any:
    """Let the effects of a stage act one after the other."""
    for piece in pieces:
        signal = piece.function(signal, *arguments, own_values(piece, memory))
    return signal


def renew(signal: Any, pieces: list[Piece], owner: Any, memory: Any, out: Any) -> None:
    """Write into `out` what effects remember once a stage has left a signal."""
    for piece in pieces:
        out[piece.place] = piece.function(signal, owner, own_values(piece, memory))
