"""A camera above a hand that says where the ball's middle is, frame by frame."""

import random
from collections.abc import Sequence
from math import dist

from tendon_hardware.virtual_bench.physics.constants import HandBallConstants
from tendon_hardware.virtual_bench.physics.load_cell import crc8

FIELD = 0.08
"""Distance from the middle of the first frame within which the camera sees the ball [m]."""


class BallCamera:
    """Finds a ball in each frame, with noise, and tells of it after a while.

    A frame's line is ``B,<sequence>,<age_us>,<x_um>,<y_um>,<z_um>*<CRC>``: the age says how long
    before the line the frame was exposed. A frame without a ball has no line.
    """

    def __init__(self, constants: HandBallConstants, rng: random.Random) -> None:
        self._constants = constants
        self._random = rng
        self._period = 1.0 / constants.camera_rate
        self._next = rng.uniform(0.0, self._period)
        self._sequence = 0
        self._middle: Sequence[float] | None = None

    @property
    def delay(self) -> float:
        """Time from a frame's exposure to its line [s]."""
        return self._constants.camera_delay

    def take(self, place: Sequence[float], time: float) -> bytes:
        """Look at the ball's middle [m]; return the line of a frame that was exposed now, if any.

        The line is on its way for `delay`.
        """
        if time < self._next:
            return b""
        self._next += self._period
        self._sequence += 1
        self._middle = self._middle or place
        if dist(place, self._middle) > FIELD:
            return b""
        noise = self._constants.camera_noise
        seen = [round(1e6 * (value + noise * self._random.gauss(0.0, 1.0))) for value in place]
        text = b"B,%d,%d,%d,%d,%d" % (self._sequence, round(1e6 * self.delay), *seen)
        return text + b"*%02X\n" % crc8(text)
