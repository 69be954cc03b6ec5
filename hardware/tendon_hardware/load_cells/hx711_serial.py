"""HX711 behind a microcontroller: the converter is clocked there, and lines come over USB.

A computer with an operating system cannot clock an HX711 safely. A clock pulse of more than 50 us
switches the chip off or changes its gain, and the wrong values look right. The microcontroller's
program stands in ``firmware/``.
"""

from tendon_hardware.clock import Clock, MonotonicClock
from tendon_hardware.errors import PortUnavailable
from tendon_hardware.load_cells.byte_stream import ByteStream, SerialStream
from tendon_hardware.load_cells.framing import WORD, LineSplitter, decode_line
from tendon_hardware.load_cells.load_cell_type import LoadCellCounters, LoadCellReading

REOPEN_PERIOD = 0.5  # Pause between attempts to open a lost port [s]
CLOCK_TOLERANCE = 1.0
"""How far the two clocks' advance between readings may differ [s]; transport takes far less."""


class Hx711Serial:
    """Readings of an HX711 over a serial port.

    Args:
        port: Path of the port, or a stream of dated bytes.
        clock: Clock that dates the arrivals; the computer's monotonic one unless given.
    """

    name = "hx711_serial"

    def __init__(self, port: str | ByteStream, *, clock: Clock | None = None) -> None:
        self._clock: Clock = MonotonicClock() if clock is None else clock
        self._stream = SerialStream(port, clock=self._clock) if isinstance(port, str) else port
        self.counters = LoadCellCounters()
        self._splitter = LineSplitter()
        self._last: LoadCellReading | None = None
        self._stray: LoadCellReading | None = None
        self._wanted = False
        self._is_open = False
        self._next_attempt = 0.0

    def open(self) -> None:
        """Start to listen.

        Raises:
            PortUnavailable: The port is not there.
            PortBusy: Another process holds it.
        """
        self._stream.open()
        self._splitter.clear()
        self._wanted = self._is_open = True
        if self.counters.silent_since is None:
            self.counters.silent_since = self._clock.now()

    def close(self) -> None:
        """Stop to listen; more than once does no harm."""
        self._wanted = self._is_open = False
        self._stream.close()

    def drain(self) -> list[LoadCellReading]:
        """Return what has come since the last call; a lost port is opened again in passing."""
        if self._wanted and not self._is_open:
            self._reopen()
        if not self._is_open:
            return []
        try:
            pieces = self._stream.receive()
        except OSError:
            self._is_open = False
            self._stream.close()
            return []
        return [
            reading
            for instant, data in pieces
            for line in self._splitter.feed(data)
            for reading in self._accept(line, instant)
        ]

    def _reopen(self) -> None:
        now = self._clock.now()
        if now < self._next_attempt:
            return
        self._next_attempt = now + REOPEN_PERIOD
        try:
            self.open()
        except PortUnavailable:
            return
        self.counters.reconnects += 1

    def _accept(self, line: bytes, instant: float) -> list[LoadCellReading]:
        """Check a line; a reading that follows no other waits for one that follows it."""
        if line.startswith(b"#"):
            return []
        reading = decode_line(line, instant)
        if reading is None:
            self.counters.rejected += 1
            return []
        if self._last is None or follows(self._last, reading):
            self.counters.rejected += self._stray is not None
            self._stray = None
            return [self._keep(reading)]
        if self._stray is not None and follows(self._stray, reading):
            stray, self._stray, self._last = self._stray, None, None
            self.counters.restarts += 1
            return [self._keep(stray), self._keep(reading)]
        self.counters.rejected += self._stray is not None
        self._stray = reading
        return []

    def _keep(self, reading: LoadCellReading) -> LoadCellReading:
        if self._last is not None:
            lost = (reading.sequence - self._last.sequence) % WORD - 1
            self.counters.gaps += lost > 0
            self.counters.lost += lost
        self._last = reading
        self.counters.lines += 1
        self.counters.silent_since = reading.host_time
        return reading


def follows(earlier: LoadCellReading, later: LoadCellReading) -> bool:
    """Tell whether a reading can come after another of the same run of the microcontroller.

    One broken line in 256 passes its CRC. The line's sequence or time then contradicts the
    neighbours'.
    """
    advance = (later.device_time_us - earlier.device_time_us) % WORD * 1e-6
    steps = (later.sequence - earlier.sequence) % WORD
    late = abs(advance - (later.host_time - earlier.host_time) % (WORD * 1e-6))
    # a converter gives 10 or 80 readings per second, so that a step takes 12 ms at least
    return 0 < steps <= 100.0 * (advance + CLOCK_TOLERANCE) and late <= CLOCK_TOLERANCE
