"""The servo's magnetic encoder and the speed that its firmware makes of it."""

import random
from math import exp, floor, pi, sin

from tendon_hardware.virtual_bench.memory.control_table import COUNTS_PER_TURN
from tendon_hardware.virtual_bench.physics.constants import ServoConstants

COUNTS_PER_RADIAN = COUNTS_PER_TURN / (2.0 * pi)


class Encoder:
    r"""Counts of an angle that is read a little off centre and with noise; a lagging speed.

    .. math:: n = \lfloor (\theta + \epsilon \sin(\theta + \phi) + \nu) / \delta \rfloor

    The speed is the counts' difference behind a first-order filter: late by its time constant, as
    the register is.
    """

    def __init__(self, constants: ServoConstants, rng: random.Random, tick: float) -> None:
        self._amplitude = constants.encoder_eccentricity
        self._phase = constants.encoder_phase
        self._noise = constants.encoder_noise
        self._blend = 1.0 - exp(-tick / constants.velocity_lag)
        self._scale = 1.0 / (COUNTS_PER_RADIAN * tick)
        self._random = rng
        # counts at the spool's zero: how the horn was put on its spline decides
        self.home = rng.randrange(300, 3500)
        self.count = self.home
        self.rate = 0.0  # [rad/s]

    def read(self, angle: float) -> None:
        """Take one reading of the shaft [rad]."""
        seen = angle + self._amplitude * (sin(angle + self._phase) - sin(self._phase))
        seen += self._noise * self._random.gauss(0.0, 1.0)
        count = floor(seen * COUNTS_PER_RADIAN + 0.5) + self.home
        self.rate += self._blend * ((count - self.count) * self._scale - self.rate)
        self.count = count
