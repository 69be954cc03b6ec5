"""Streams of bytes with known contents."""

from tendon_hardware.load_cells.framing import crc8
from tendon_hardware.load_cells.load_cell_type import LoadCellReading


def encode_frame(frame: LoadCellReading) -> bytes:
    """Write the line of a reading, as the firmware does."""
    body = f"L,{frame.sequence},{frame.device_time_us},{frame.counts}".encode()
    return body + b"*%02X\n" % crc8(body)


class StillClock:
    """A clock that is set by hand."""

    def __init__(self) -> None:
        self.time = 0.0

    def now(self) -> float:
        """Return the time that was set [s]."""
        return self.time

    def sleep_until(self, instant: float) -> None:
        """Set the time forward."""
        self.time = max(self.time, instant)


class WrittenStream:
    """A stream that gives what was written into it, or fails as told."""

    name = "written"

    def __init__(self) -> None:
        self.pieces: list[tuple[float, bytes]] = []
        self.lost = False
        self.openings = 0

    def open(self) -> None:
        """Count the openings; a stream that is lost stays so."""
        if self.lost:
            from tendon_hardware.errors import PortUnavailable

            raise PortUnavailable("written: no such port")
        self.openings += 1

    def close(self) -> None:
        """Do nothing."""

    def receive(self) -> list[tuple[float, bytes]]:
        """Return what was written."""
        if self.lost:
            raise OSError("gone")
        pieces, self.pieces = self.pieces, []
        return pieces


def frame(k: int, *, start: int = 0, period: float = 0.0125, counts: int = 100) -> LoadCellReading:
    """Return the k-th frame of a regular stream; its line does not say when it arrives."""
    return LoadCellReading(
        sequence=(start + k) % 2**32,
        device_time_us=round((start + k) * period * 1e6) % 2**32,
        host_time=0.0,
        counts=counts,
    )


def lines(first: int, last: int, **words: float) -> list[tuple[float, bytes]]:
    """Return dated lines of a regular stream whose clock is the host's."""
    return [(k * 0.0125, encode_frame(frame(k, **words))) for k in range(first, last)]
