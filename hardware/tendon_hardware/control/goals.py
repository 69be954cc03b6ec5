"""Sources of a policy's goals: keys, a file, lines, stairs, or one number.

A goal is an angle alpha [rad]: 0 is the straight finger, pi/2 the tip below the PIP axis. A line
holds one number; what is none is told once and changes nothing.
"""

import math
from bisect import bisect_right
from collections.abc import Sequence
from pathlib import Path

from tendon_hardware.control.goal_lines import Goals, LineGoals, parse_goal
from tendon_newton.data.files.text_file import read_text
from tendon_newton.errors import InvalidGoal, shown

FILE_SIZE_LIMIT = 1_000_000  # Bytes of a file of goals
ROUNDING = 1e-4  # [rad] by which a goal that was written with few digits may lie beyond the bounds
STEP = math.pi / 60.0  # Angle by which an arrow key moves the goal [rad]: 3 degrees
STAIR, DWELL = math.pi / 10.0, 1.5
"""Height [rad] and length [s] of the paper's stairs; the last goal of a file is held as long."""


class FixedGoal(Goals):
    """A goal that arrow keys move.

    Args:
        value: The first goal [rad].
        bounds: Least and greatest goal [rad].
        step: Angle by which a key moves the goal [rad].
    """

    def __init__(self, value: float, bounds: tuple[float, float], step: float = STEP) -> None:
        super().__init__()
        self._bounds = bounds
        self._step = step
        self._value = min(max(value, bounds[0]), bounds[1])

    def value(self, now: float) -> float:
        """Return the goal [rad]."""
        return self._value

    def key(self, key: str) -> None:
        """Move the goal: up and down by a step, 0 to 9 to a place between the bounds."""
        low, high = self._bounds
        move = {"up": 1.0, "right": 1.0, "+": 1.0, "down": -1.0, "left": -1.0, "-": -1.0}.get(key)
        if move is not None:
            self._value = min(max(self._value + move * self._step, low), high)
        elif key.isdecimal():
            self._value = low + (high - low) * int(key) / 9.0


class TimedGoals(Goals):
    """Goals at set times.

    Args:
        instants: When each begins to hold [s], from 0 on, increasing.
        values: The goals [rad].
        last: Time that the last one is held [s].
    """

    def __init__(
        self, instants: Sequence[float], values: Sequence[float], last: float = DWELL
    ) -> None:
        super().__init__(length=instants[-1] + last)
        self._instants = list(instants)
        self._values = list(values)

    @property
    def end(self) -> float:
        """When the last one begins to hold [s]."""
        return self._instants[-1]

    def value(self, now: float) -> float:
        """Return the goal [rad] at a time since the start [s]."""
        return self._values[max(bisect_right(self._instants, now) - 1, 0)]


def stairs(dwell: float = DWELL) -> TimedGoals:
    """Return the paper's stairs: from 0 to pi/2 and back by pi/10, resting on each."""
    levels = [STAIR * level for level in (*range(6), *range(4, -1, -1))]
    return TimedGoals([dwell * place for place in range(len(levels))], levels, dwell)


def check_goal(value: float, bounds: tuple[float, float], where: str = "") -> None:
    """Refuse a goal that a policy never learnt to reach; it would take its greatest for it."""
    if not bounds[0] - ROUNDING <= value <= bounds[1] + ROUNDING:
        raise InvalidGoal(
            f"{where}goals of this policy are {bounds[0]:.4g} to {bounds[1]:.4g} rad, of one that "
            f"turns a ball rad/s; it is {value:g} (degrees are times 0.01745)"
        )


def read_goals(path: Path, bounds: tuple[float, float] = (-math.inf, math.inf)) -> TimedGoals:
    """Read goals from a file: on each line a time [s] and a goal [rad]; # begins a comment.

    Raises:
        InvalidGoal: A line holds no goal, or one beyond bounds, or times do not increase from 0.
    """
    promise = "goals are lines with a time in s and an angle in rad"
    text = read_text(path, InvalidGoal, promise, size_limit=FILE_SIZE_LIMIT)
    instants: list[float] = []
    values: list[float] = []
    for number, line in enumerate(text.splitlines(), start=1):
        words = line.partition("#")[0].replace(",", " ").split()
        if not words:
            continue
        try:
            instant, value = (parse_goal(word) for word in words)
        except (InvalidGoal, ValueError) as error:
            raise InvalidGoal(f"{path}: line {number}: {promise}; it is {shown(line)}") from error
        if instant < 0.0 or (instants and instant <= instants[-1]):
            raise InvalidGoal(f"{path}: line {number}: times must increase from 0; it is {instant}")
        check_goal(value, bounds, f"{path}: line {number}: ")
        instants.append(instant)
        values.append(value)
    if not instants:
        raise InvalidGoal(f"{path}: {promise}; there is none")
    return TimedGoals(instants, values)


def open_goals(word: str, bounds: tuple[float, float]) -> Goals:
    """Return the goals that a word names.

    Args:
        word: ``keyboard``, ``stdin``, ``stairs``, an angle [rad], or the path of a file.
        bounds: Least and greatest goal [rad].

    Raises:
        InvalidGoal: The file holds no goals, or one lies beyond the bounds.
    """
    if word == "keyboard":
        return FixedGoal(bounds[0], bounds)
    if word == "stdin":
        return LineGoals(bounds[0])
    if word == "stairs":
        return stairs()
    try:
        goal = parse_goal(word)
    except InvalidGoal:
        return read_goals(Path(word), bounds)
    check_goal(goal, bounds)
    return FixedGoal(goal, bounds)
