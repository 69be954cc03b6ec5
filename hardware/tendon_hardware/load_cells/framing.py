r"""Lines of a load cell: made by the microcontroller, found again in whatever bytes arrive.

One line per conversion, ``L,<sequence>,<time_us>,<counts>*<CRC>\n``: decimal numbers, the counts
signed, and two hexadecimal digits of a CRC-8 over all that stands before the star (polynomial 0x07,
start 0, nothing reflected). Lines that begin with ``#`` inform a reader and are skipped.
"""

import re

from tendon_hardware.load_cells.load_cell_type import LoadCellReading

LINE = re.compile(rb"L,(\d{1,10}),(\d{1,10}),(-?\d{1,7})\*([0-9A-Fa-f]{2})")
LONGEST_LINE = 64  # More bytes without an end of line are no line: the longest reading has 36
WORD = 1 << 32  # Sequence and time are 32-bit words that wrap
POLYNOMIAL = 0x07


def crc8(data: bytes) -> int:
    """Return the checksum of the bytes of a line before its star."""
    crc = 0
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = (crc << 1 ^ POLYNOMIAL) & 0xFF if crc & 0x80 else crc << 1
    return crc


def decode_line(line: bytes, arrived: float) -> LoadCellReading | None:
    """Read a line without its end; ``None`` unless all of it is as it was sent.

    Args:
        arrived: Arrival on the bench's clock [s].
    """
    match = LINE.fullmatch(line)
    if match is None or int(match[4], 16) != crc8(line[: match.start(4) - 1]):
        return None
    sequence, time, counts = int(match[1]), int(match[2]), int(match[3])
    if sequence >= WORD or time >= WORD or not -0x800000 <= counts <= 0x7FFFFF:
        return None
    return LoadCellReading(sequence=sequence, device_time_us=time, host_time=arrived, counts=counts)


class LineSplitter:
    """Cut a stream of bytes into lines, however it was broken into pieces."""

    def __init__(self) -> None:
        self._rest = b""

    def feed(self, data: bytes) -> list[bytes]:
        """Return the lines that these bytes complete, without their ends and without empty ones."""
        *lines, self._rest = (self._rest + data).split(b"\n")
        if len(self._rest) > LONGEST_LINE:  # garbage; its end will be rejected with the next line
            self._rest = self._rest[-LONGEST_LINE:]
        return [line.rstrip(b"\r") for line in lines if line.strip(b"\r")]

    def clear(self) -> None:
        """Forget the beginning of a line whose end will never come."""
        self._rest = b""
