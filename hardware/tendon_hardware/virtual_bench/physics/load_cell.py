"""A load cell behind an HX711 and a microcontroller that sends its conversions as lines."""

import random
from collections import deque

from tendon_hardware.virtual_bench.physics.constants import LoadCellConstants
from tendon_newton.errors import InvalidParameter

FULL_SCALE = 2**23 - 1
FILTER = (0.125, 0.375, 0.375, 0.125)
"""Weights of the last four conversion periods: settled after 50 ms at 80 SPS (HX711 data sheet)."""
RATES = (80, 20, 10)
"""Lines per second [Hz]: 80 and 10 are what the chip's RATE pin can choose, 20 is the mean of four
conversions at 80, made by the microcontroller."""
BANNER = b"\x00\xf8boot\r\n# tendon load cell, HX711 gain 128\n"
GRAVITY = 9.80665  # [m/s^2] of the masses that an operator hangs on the hook
SPIKE = 1_500_000  # Error of a reading that is a spike [counts]: 35 N


def crc8(data: bytes) -> int:
    """Return the check sum of a line: polynomial 0x07, initial value 0."""
    value = 0
    for byte in data:
        value ^= byte
        for _ in range(8):
            value = ((value << 1) ^ 0x07 if value & 0x80 else value << 1) & 0xFF
    return value


class LoadCellBoard:
    """Turns tension into lines, on the board's own clock.

    Each conversion averages its period; the chip's filter weighs four of them, so a reading is two
    periods late: 25 ms at 80 SPS.
    """

    def __init__(self, constants: LoadCellConstants, rng: random.Random, rate: int = 80) -> None:
        if rate not in RATES:
            raise InvalidParameter(f"The load cell sends 80, 20 or 10 lines a second; not {rate}")
        self._constants = constants
        self._random = rng
        self._average = 4 if rate == 20 else 1
        native = 80 if rate == 20 else rate
        self.rate = rate
        self._period = 1.0 / (native * (1.0 + constants.rate_error))
        self._end = self._period
        self._sum = 0.0
        self._ticks = 0
        self._periods: deque[float] = deque([0.0] * len(FILTER), maxlen=len(FILTER))
        self._group: list[int] = []
        self._wander = 0.0
        # [s] the board has run before: its clock of 32 bits wraps sooner or later
        self._boot = rng.uniform(0.0, 4e3)
        self._sequence = rng.randrange(0, 1000)
        self.mass: float | None = None  # Hung on the hook in place of the tendon [kg]
        self._fault = ""
        self._fault_until = 0.0
        self._fault_counts: int | None = None
        self._felt = 0.0
        self._last_counts = 0

    def disturb(self, name: str, until: float, counts: int | None = None) -> None:
        """Let something be wrong with the cell until an instant [s]: an event of a bench's faults.

        Args:
            name: ``cell_stuck``, ``cell_spike``, which lasts for one reading, or ``cell_deaf``.
            until: End of the event [s].
            counts: What it says then [counts].
        """
        self._fault, self._fault_until, self._fault_counts = name, until, counts

    def take(self, tension: float, time: float) -> bytes:
        """Take one millisecond's tension [N] and return the line that it completes, if any."""
        self._sum += tension
        self._ticks += 1
        if time < self._end:
            return b""
        mean = self._sum / self._ticks if self.mass is None else self.mass * GRAVITY
        if self._fault == "cell_deaf" and time < self._fault_until:
            mean = self._felt
        self._felt = mean
        self._sum, self._ticks = 0.0, 0
        self._end += self._period
        self._periods.append(mean)
        self._group.append(self._convert(time))
        if len(self._group) < self._average:
            return b""
        counts = round(sum(self._group) / len(self._group))
        self._group.clear()
        self._last_counts = self._disturbed(counts, time)
        return self._line(self._last_counts, time)

    def _disturbed(self, counts: int, time: float) -> int:
        """Return what the cell says in place of counts."""
        told = self._fault_counts
        if self._fault == "cell_spike":
            self._fault = ""
            return min(counts + SPIKE, FULL_SCALE) if told is None else told
        if self._fault == "cell_stuck" and time < self._fault_until:
            return self._last_counts if told is None else told
        return counts

    def _convert(self, time: float) -> int:
        """Return the chip's counts."""
        c = self._constants
        self._wander += c.wander * self._period**0.5 * self._random.gauss(0.0, 1.0)
        force = sum(w * v for w, v in zip(FILTER, self._periods, strict=True))
        force += c.noise * self._random.gauss(0.0, 1.0) + c.drift * time + self._wander
        return max(-FULL_SCALE - 1, min(FULL_SCALE, round(c.offset + c.counts_per_newton * force)))

    def _line(self, counts: int, time: float) -> bytes:
        """Return one line of the stream."""
        micros = round((self._boot + time * (1.0 + self._constants.clock_error)) * 1e6) % 2**32
        text = b"L,%d,%d,%d" % (self._sequence, micros, counts)
        self._sequence += 1
        return text + b"*%02X\n" % crc8(text)
