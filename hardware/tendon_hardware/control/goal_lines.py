"""A source of goals, and goals that come as lines."""

import math
import os
import select
import sys

from tendon_newton.errors import InvalidGoal, shown

LINE_MAX = 200  # Characters of a line with a goal
PIECE = 4096  # Bytes taken at a time, so that a flood of lines cannot hold the loop up


class Goals:
    """Gives the goal that holds now; none come after its length [s], where it has one."""

    def __init__(self, length: float | None = None) -> None:
        self.length = length
        self.notes: list[str] = []  # Messages for the operator; the teller empties the list

    def value(self, now: float) -> float:
        """Return the goal [rad] at a time since the start [s]."""
        raise NotImplementedError

    def key(self, key: str) -> None:
        """Take a key that was pressed; most goals are not moved by keys."""

    def close(self) -> None:
        """Let go of what was opened; more than once does no harm."""


def parse_goal(line: str) -> float:
    """Return the goal [rad] that a line holds.

    Raises:
        InvalidGoal: The line holds no single finite number.
    """
    try:
        value = float(line.strip()) if len(line) <= LINE_MAX else math.nan
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InvalidGoal(f"a goal is one number, an angle in rad; it is {shown(line.strip())}")
    return value


class LineGoals(Goals):
    """Goals as lines that come over a descriptor: the standard input or a pipe.

    Args:
        value: The goal [rad] before the first line.
        number: The descriptor; the standard input's unless given.
    """

    def __init__(self, value: float = 0.0, number: int | None = None) -> None:
        super().__init__()
        self._number = sys.stdin.fileno() if number is None else number
        self._value = value
        self._rest = b""
        self._ended = False
        self._told = False

    def value(self, now: float) -> float:
        """Return the goal of the last line [rad]."""
        if not self._ended and select.select([self._number], [], [], 0.0)[0]:
            try:
                data = os.read(self._number, PIECE)
            except OSError:  # a terminal that is gone
                data = b""
            self._ended = not data
            *lines, self._rest = (self._rest + data).split(b"\n")
            self._rest = self._rest[: LINE_MAX + 1]
            for line in lines:
                self.take(line)
            if self._ended:
                self.notes.append("No more goals come; the last one stays.")
        return self._value

    def take(self, line: bytes) -> bool:
        """Take a line; return whether it is a goal. A line without a goal is told once."""
        if not line.strip():
            return False
        try:
            self._value = parse_goal(line.decode("ascii", errors="replace"))
        except InvalidGoal as error:
            self.notes += [] if self._told else [f"{error}: it is ignored, as others will be"]
            self._told = True
            return False
        return True
