"""Commands that were given, for servos that answer them late."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

INSTANT = 1.0e-6  # Instants [s] closer than this are one
REMEMBERED = 1.0  # For how long commands and readings are kept [s]; nothing is later


class CommandHistory:
    """Commands of all servos by the instant from which on they hold.

    It begins with what was always commanded before [rad], shape (D,).
    """

    def __init__(self, command: Any) -> None:
        self.edges = [(-math.inf, command.copy())]

    def note(self, time: float, command: Any) -> None:
        """Keep a command [rad] that has changed by some time [s]."""
        if not np.array_equal(self.edges[-1][1], command):
            self.edges.append((time, command.copy()))
            while len(self.edges) > 2 and self.edges[1][0] < time - REMEMBERED:
                del self.edges[0]

    def at(self, instant: float) -> Any:
        """Return the command [rad] in force at an instant [s]."""
        return next(c for t, c in reversed(self.edges) if t <= instant + INSTANT)

    def mean(self, d: int, start: float, end: float) -> float:
        """Return the mean command [rad] of a servo between two instants [s]."""
        total, upper = 0.0, end
        for edge, command in reversed(self.edges):
            if edge < upper - 1.0e-12:
                total += (upper - max(edge, start)) * command[d]
                upper = max(edge, start)
            if upper <= start + 1.0e-12:
                break
        return float(total / (end - start))
