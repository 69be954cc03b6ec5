r"""What any camera tells, and one whose program sends a line for each frame with a ball.

``B,<sequence>,<age_us>,<x_um>,<y_um>,<z_um>,<qx>,<qy>,<qz>,<qw>*<CRC>\n``: decimal numbers, the
last seven signed, and two hexadecimal digits of a load cell's CRC-8 over all that stands before the
star. The age says how long before the line its frame was exposed. The quaternion, in millionths,
says from marks on the ball how it is turned. Lines come over a serial port or a pseudo-terminal.
"""

import re
from dataclasses import dataclass
from math import hypot
from typing import Protocol

from tendon_hardware.clock import Clock, MonotonicClock
from tendon_hardware.load_cells.byte_stream import ByteStream, SerialStream
from tendon_hardware.load_cells.framing import LineSplitter, crc8

Place = tuple[float, float, float]  # Place of the ball's middle, in the axes of the hand's base [m]


@dataclass(frozen=True, kw_only=True, slots=True)
class Sighting:
    """The ball in one frame."""

    sequence: int  # Number of the frame since the camera started; it grows
    exposed: float  # Middle of the exposure on the bench's clock [s]
    arrived: float  # When this program could know [s], after `exposed`
    place: Place
    # Quaternion (x, y, z, w) from the ball's axes to those of the hand's base, of any length but 0
    turn: tuple[float, float, float, float]


class Camera(Protocol):
    """A camera that runs by itself and is emptied now and then.

    One that is plugged into this computer does the same as one behind lines: find the ball in each
    frame, and keep what was found until it is asked for.
    """

    def open(self) -> None:
        """Start to look.

        Raises:
            PortUnavailable: The camera is not there.
            PortBusy: Another process holds it.
        """

    def close(self) -> None:
        """Stop to look; more than once does no harm."""

    def drain(self) -> list[Sighting]:
        """Return what was seen since the last call, in order, at once and without ever waiting.

        A frame without a ball gives nothing, and so does a camera that is gone.
        """
        ...


LINE = re.compile(rb"B,(\d{1,10}),(\d{1,8})" + 7 * rb",(-?\d{1,7})" + rb"\*([0-9A-Fa-f]{2})")
SHORTEST = 0.1  # Length of a quaternion below which it says no rotation [1]
GAP_MAX = 300
"""Frames that may be missing between two lines [1]: ten seconds of a ball that nobody saw."""


class LineCamera:
    """Sightings from lines.

    Args:
        port: Path of the port, or a stream of dated bytes.
        clock: Clock that dates the arrivals; the computer's monotonic one unless given.
    """

    def __init__(self, port: str | ByteStream, *, clock: Clock | None = None) -> None:
        own = MonotonicClock() if clock is None else clock
        self._stream = SerialStream(port, clock=own) if isinstance(port, str) else port
        self._splitter = LineSplitter()
        self._last = -1
        self._astray: int | None = None

    def open(self) -> None:
        """Start to listen.

        Raises:
            PortUnavailable: The port is not there.
            PortBusy: Another process holds it.
        """
        self._stream.open()
        self._splitter.clear()

    def close(self) -> None:
        """Stop to listen; more than once does no harm."""
        self._stream.close()

    def drain(self) -> list[Sighting]:
        """Return what has come since the last call, in order; of a port that is gone nothing."""
        try:
            pieces = self._stream.receive()
        except OSError:
            return []
        found = [
            read_line(line, instant)
            for instant, data in pieces
            for line in self._splitter.feed(data)
        ]
        return [sighting for sighting in found if sighting is not None and self._follows(sighting)]

    def _follows(self, sighting: Sighting) -> bool:
        """Keep a sighting whose frame comes after the last one's.

        A number that does not is a broken line, or the first of a camera's program that has begun
        anew: the next line tells.
        """
        number, before = sighting.sequence, self._astray
        self._astray = None
        anew = before is not None and 0 < number - before <= GAP_MAX
        if not anew and not 0 < number - self._last <= GAP_MAX:
            self._astray = number
            return False
        self._last = number
        return True


def read_line(line: bytes, arrived: float) -> Sighting | None:
    """Read a line without its end; ``None`` unless all of it is as it was sent, and is a turn."""
    match = LINE.fullmatch(line)
    if match is None or int(match[10], 16) != crc8(line[: match.start(10) - 1]):
        return None
    x, y, z, *turn = (1e-6 * int(match[group]) for group in range(3, 10))
    if hypot(*turn) < SHORTEST:
        return None
    return Sighting(
        sequence=int(match[1]),
        exposed=arrived - 1e-6 * int(match[2]),
        arrived=arrived,
        place=(x, y, z),
        turn=(turn[0], turn[1], turn[2], turn[3]),
    )
