"""Commands: what the servo is asked to do, one row every 1/80 s."""

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

ROW_RATE = 80.0  # [Hz]
FULL_TURN = 2.0 * np.pi
DURATION = (12.0, 19.0)  # [s]


def row_times(rng: np.random.Generator, duration: tuple[float, float] = DURATION) -> Array:
    """Draw a length from a range [s] and return the row instants [s]."""
    return np.arange(int(rng.uniform(*duration) * ROW_RATE)) / ROW_RATE


def steps(rng: np.random.Generator, rows: int) -> Array:
    """Random levels in [0, 2 pi] rad, each held 0.5 to 3 s."""
    command = np.empty(rows)
    row = 0
    while row < rows:
        held = int(rng.uniform(0.5, 3.0) * ROW_RATE)
        command[row : row + held] = rng.uniform(0.0, FULL_TURN)
        row += held
    return command


def sine(rng: np.random.Generator, rows: int) -> Array:
    """Sinusoids of amplitude pi/2 at pi to 4 pi rad/s, a new centre and pace every 3 to 7 s."""
    command = np.empty(rows)
    row = 0
    while row < rows:
        length = int(rng.uniform(3.0, 7.0) * ROW_RATE)
        centre = rng.uniform(np.pi / 2.0, 3.0 * np.pi / 2.0)
        pace = rng.uniform(np.pi, 4.0 * np.pi)
        phase = pace * np.arange(length) / ROW_RATE + rng.uniform(0.0, FULL_TURN)
        part = command[row : row + length]
        part[:] = centre + np.pi / 2.0 * np.sin(phase)[: part.size]
        row += length
    return command


def ramp(rng: np.random.Generator, rows: int) -> Array:
    """Up and down at 1 to 2 rad/s, with short rests at the turns."""
    level = rng.uniform(0.0, 1.0)
    parts = [np.full(int(rng.uniform(0.2, 0.5) * ROW_RATE), level)]
    up = True
    while sum(part.size for part in parts) < rows:
        low, high = (level + 1.0, FULL_TURN) if up else (0.0, level - 1.0)
        target = rng.uniform(low, max(low, high))
        length = max(1, int(abs(target - level) / rng.uniform(1.0, 2.0) * ROW_RATE))
        parts.append(np.linspace(level, target, length + 1)[1:])
        parts.append(np.full(int(rng.uniform(0.0, 0.5) * ROW_RATE), target))
        level, up = target, not up
    return np.clip(np.concatenate(parts)[:rows], 0.0, FULL_TURN)


def stairs(rng: np.random.Generator, rows: int) -> Array:
    """Stairs of 0.1 rad, each held 0.2 to 0.25 s, turning round at drawn levels."""
    held = int(rng.uniform(0.2, 0.25) * ROW_RATE)
    level, up, left = rng.uniform(0.1, 1.0), True, int(rng.uniform(15, 40))
    command = np.empty(rows)
    for row in range(0, rows, held):
        command[row : row + held] = level
        if left == 0 or not 0.1 <= level + (0.1 if up else -0.1) <= FULL_TURN:
            up, left = not up, int(rng.uniform(8, 25))
        level += 0.1 if up else -0.1
        left = max(0, left - 1)
    return command


COMMANDS: Mapping[str, Callable[[np.random.Generator, int], Array]] = {
    "steps": steps,
    "sine": sine,
    "ramp": ramp,
    "stairs": stairs,
}
