"""Commands described by numbers from 0 to 1, so that a search can improve them."""

from dataclasses import dataclass
from math import pi
from typing import Self

import numpy as np

from tendon_newton.data.excitations import LARGEST_COMMAND
from tendon_newton.data.recording import Array

SEGMENTS = 8  # Segments of a command
NUMBERS = 5  # Numbers of a segment: angle, speed, length, swing and frequency
SPEEDS = (0.3, 100.0)  # Slowest ramp, in which friction is all that is dynamic, and a step [rad/s]
LONGEST_TO_SHORTEST = 8.0  # How much longer the longest segment may be than the shortest one [1]
LARGEST_SWING = pi / 4.0
"""Amplitude of the swing about a ramp or a hold [rad]; half of all segments have none."""
FREQUENCIES = (0.5, 6.0)  # Frequencies of the swing [Hz]
COMMAND_RATE = 20.0  # Commands per second, as a bench is commanded [Hz]


@dataclass(frozen=True, kw_only=True)
class DesignedCommand:
    """Moves to angles at speeds, holds there, and a swing on top of either.

    Steps, ramps, holds, sinusoids and drops onto a stop are all of this form.
    """

    numbers: Array  # Numbers of each segment, each from 0 to 1, shape (SEGMENTS, NUMBERS)

    @classmethod
    def draw(cls, rng: np.random.Generator, reach: float = 1.0) -> Self:
        """Draw any command.

        Args:
            rng: Draws its numbers.
            reach: Share of the servo's range that it may use [1]; a gentle one swings little.
        """
        numbers = rng.uniform(size=(SEGMENTS, NUMBERS))
        return cls(numbers=numbers * np.array([reach, 1.0, 1.0, reach, 1.0]))

    def moved(self, rng: np.random.Generator, share: float, size: float) -> Self:
        """Return a command near this one.

        Args:
            rng: Draws which numbers move, and by how much.
            share: Share of the numbers that move [1].
            size: Standard deviation of a move [1].
        """
        moves = rng.normal(scale=size, size=self.numbers.shape)
        chosen = rng.uniform(size=self.numbers.shape) < share
        return type(self)(numbers=np.clip(self.numbers + chosen * moves, 0.0, 1.0))

    def at(self, time: Array) -> Array:
        """Return the command [rad], shape (T,), inside the servo's range.

        Args:
            time: Rows from 0 [s], shape (T,).
        """
        angle, speed, length, swing, frequency = self.numbers.T
        goals = LARGEST_COMMAND * angle
        speeds = SPEEDS[0] * (SPEEDS[1] / SPEEDS[0]) ** speed
        swings = LARGEST_SWING * np.maximum(0.0, 2.0 * swing - 1.0)
        rates = FREQUENCIES[0] * (FREQUENCIES[1] / FREQUENCIES[0]) ** frequency
        lengths = LONGEST_TO_SHORTEST**length
        ends = np.cumsum(lengths) / lengths.sum() * float(time[-1])
        now = np.floor(time * COMMAND_RATE + 1.0e-9) / COMMAND_RATE
        command, begin, place = np.zeros_like(time), 0.0, 0.0
        for k, end in enumerate(ends):
            rows = (now >= begin) if k == len(ends) - 1 else (now >= begin) & (now < end)
            since = now[rows] - begin
            way = goals[k] - place
            ramp = place + np.sign(way) * np.minimum(abs(way), speeds[k] * since)
            command[rows] = ramp + swings[k] * np.sin(2.0 * pi * rates[k] * since)
            place += np.sign(way) * min(abs(way), speeds[k] * (end - begin))
            begin = end
        return np.clip(command, 0.0, LARGEST_COMMAND)
