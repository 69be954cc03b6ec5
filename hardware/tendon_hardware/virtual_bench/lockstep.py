"""A virtual bench whose clock advances only while its user waits: data faster than real time.

The driver, the loop and the log are the very same as on a real bench; only the clock, the port
handler and the load cell's stream come from here.
"""

import termios
from collections import deque
from collections.abc import Callable
from functools import cached_property
from pathlib import Path

from tendon_hardware.virtual_bench.emulation.truth import write_plant_file
from tendon_hardware.virtual_bench.served_bench import Reply, VirtualBench

UNPLUGGED = termios.error(5, "Input/output error")
"""Error of an adapter that is gone; no OSError, as in reality."""


class LockstepClock:
    """The bench's own time: sleeping on it makes the plant move."""

    def __init__(self, bench: VirtualBench) -> None:
        self._bench = bench
        self._now = 0.0

    def now(self) -> float:
        """Return the time [s]."""
        return self._now

    def sleep_until(self, instant: float) -> None:
        """Let the plant run up to an instant [s]; an instant that has passed is no wait."""
        if instant > self._now:
            self._now = instant
            self._bench.advance(instant)


class LockstepServoPort:
    """What dynamixel_sdk asks of a port, with the emulated servo at its other end.

    A method's name and case are the SDK's. Time passes while bytes are on the line and while a
    reply is awaited.
    """

    LATENCY_TIMER = 1.0  # Latency that the SDK counts twice into its wait for a reply [ms]

    def __init__(self, bench: VirtualBench, clock: LockstepClock) -> None:
        self._bench = bench
        self._clock = clock
        self._replies: deque[Reply] = deque()
        self._received = bytearray()
        self._deadline = 0.0
        self._baud = 1_000_000
        self._handle = 0.0
        self.is_open = False
        self.is_using = False
        self.port_name = "lockstep"

    def closePort(self) -> None:  # noqa: N802  # the SDK's name, as those below
        """Close the port and forget what was on its way."""
        self._replies.clear()
        self._received.clear()
        self.is_open = False

    def clearPort(self) -> None:  # noqa: N802
        """Forget what has arrived."""
        self._check()
        self._arrive()
        self._received.clear()

    def setBaudRate(self, baudrate: int) -> bool:  # noqa: N802
        """Set the speed [bit/s] and open the port."""
        if not self._bench.plugged:
            raise FileNotFoundError(2, "No such file or directory", self.port_name)
        self._baud = baudrate
        self._handle = self._bench.unplugged_until
        self.is_open = True
        self._replies.clear()
        self._received.clear()
        return True

    def getBaudRate(self) -> int:  # noqa: N802
        """Return the speed [bit/s]."""
        return self._baud

    def getBytesAvailable(self) -> int:  # noqa: N802
        """Return how many bytes have arrived."""
        self._check()
        self._arrive()
        return len(self._received)

    def readPort(self, length: int) -> bytes:  # noqa: N802
        """Return up to so many bytes; where none are there, wait for those on their way."""
        self._check()
        self._arrive()
        if not self._received and self._replies and self._replies[0].due <= self._deadline:
            self._clock.sleep_until(self._replies[0].due)
            self._check()
            self._arrive()
        data = bytes(self._received[:length])
        del self._received[:length]
        return data

    def writePort(self, packet: bytes | list[int]) -> int:  # noqa: N802
        """Send bytes; time passes while they are on the line."""
        self._check()
        data = bytes(packet)
        self._clock.sleep_until(self._clock.now() + 10.0 * len(data) / self._baud)
        self._check()
        self._replies.extend(self._bench.receive(data, self._clock.now(), self._baud))
        return len(data)

    def setPacketTimeout(self, packet_length: int) -> None:  # noqa: N802
        """Wait for a packet of so many bytes."""
        line = 1e4 * packet_length / self._baud
        self.setPacketTimeoutMillis(line + 2.0 * self.LATENCY_TIMER + 2.0)

    def setPacketTimeoutMillis(self, msec: float) -> None:  # noqa: N802
        """Wait so many milliseconds."""
        self._deadline = self._clock.now() + 1e-3 * msec

    def isPacketTimeout(self) -> bool:  # noqa: N802
        """Return whether waiting is over; the SDK asks when it has found too few bytes."""
        self._arrive()
        if self._received or (self._replies and self._replies[0].due <= self._deadline):
            return False
        self._clock.sleep_until(self._deadline)
        return True

    def _arrive(self) -> None:
        """Take in what has arrived by now."""
        now = self._clock.now()
        while self._replies and self._replies[0].due <= now:
            self._received += self._replies.popleft().data

    def _check(self) -> None:
        """Fail as the kernel does where the adapter was unplugged, even if it is back since."""
        if not self.is_open or self._bench.unplugged_until != self._handle:
            raise termios.error(*UNPLUGGED.args)


class LockstepStream:
    """Lines of a sensor, sent up to an instant [s], with the instants at which they arrived."""

    def __init__(
        self, name: str, lines: Callable[[float], list[Reply]], clock: LockstepClock
    ) -> None:
        self.name = name
        self._lines = lines
        self._clock = clock

    def open(self) -> None:
        """Begin to receive: what came before is gone."""
        self._lines(self._clock.now())

    def close(self) -> None:
        """Stop to receive."""

    def receive(self) -> list[tuple[float, bytes]]:
        """Return arrival [s] and bytes of each line since the last call."""
        return [(line.due, line.data) for line in self._lines(self._clock.now())]


class LockstepBench(VirtualBench):
    """A virtual bench for a program that runs as fast as it can."""

    @cached_property
    def clock(self) -> LockstepClock:
        """The bench's own clock."""
        return LockstepClock(self)

    def servo_port(self) -> LockstepServoPort:
        """Return a port handler for dynamixel_sdk."""
        return LockstepServoPort(self, self.clock)

    def load_cell_stream(self, place: int = 0) -> LockstepStream:
        """Return the stream of dated bytes of the load cell in one of the tendons."""
        return LockstepStream(
            "lockstep load cell", lambda time: self.cell_lines(time, place), self.clock
        )

    def camera_stream(self) -> LockstepStream:
        """Return the stream of dated lines of the camera that sees the ball."""
        return LockstepStream("lockstep camera", self.camera_lines, self.clock)

    def plant_file(self, path: Path) -> None:
        """Write every constant of this unit, and the effects that they amount to, as TOML."""
        write_plant_file(path, self.unit)
