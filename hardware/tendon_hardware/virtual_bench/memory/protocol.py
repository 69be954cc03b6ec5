"""Frames of Dynamixel Protocol 2.0: CRC-16, byte stuffing, parsing of a stream.

Source: ROBOTIS e-manual, Protocol 2.0. CRC-16 (IBM/BUYPASS): polynomial 0x8005, initial value 0.
"""

from dataclasses import dataclass

HEADER = b"\xff\xff\xfd\x00"
BROADCAST = 0xFE
LONGEST_FRAME = 1024

PING, READ, WRITE, REBOOT, STATUS = 0x01, 0x02, 0x03, 0x08, 0x55

UNKNOWN_INSTRUCTION, BAD_CRC, BAD_RANGE = 2, 3, 4
BAD_LENGTH, BEYOND_LIMIT, NO_ACCESS, ALERT = 5, 6, 7, 0x80


def crc_row(byte: int) -> int:
    """Return the CRC of one leading byte."""
    value = byte << 8
    for _ in range(8):
        value = (value << 1) ^ 0x8005 if value & 0x8000 else value << 1
    return value & 0xFFFF


CRC_TABLE = tuple(crc_row(byte) for byte in range(256))


def crc16(data: bytes | bytearray) -> int:
    """Return the check sum over a frame without its own two bytes."""
    value = 0
    for byte in data:
        value = ((value << 8) & 0xFFFF) ^ CRC_TABLE[(value >> 8) ^ byte]
    return value


def stuffed(body: bytes) -> bytes:
    """Put an FD behind each FF FF FD, so that a body never looks like a header."""
    return body.replace(b"\xff\xff\xfd", b"\xff\xff\xfd\xfd")


def unstuffed(body: bytes) -> bytes:
    """Undo ``stuffed``; a body that was sent without stuffing passes unchanged."""
    return body.replace(b"\xff\xff\xfd\xfd", b"\xff\xff\xfd")


def frame(identifier: int, instruction: int, parameters: bytes) -> bytes:
    """Build a frame, stuffed and with its CRC."""
    body = stuffed(bytes([instruction]) + parameters)
    head = HEADER + bytes([identifier]) + (len(body) + 2).to_bytes(2, "little")
    packet = head + body
    return packet + crc16(packet).to_bytes(2, "little")


def status_frame(identifier: int, error: int, parameters: bytes = b"") -> bytes:
    """Build a servo's answer."""
    return frame(identifier, STATUS, bytes([error]) + parameters)


@dataclass(frozen=True, kw_only=True, slots=True)
class Instruction:
    """Content of one frame from the bus."""

    identifier: int
    code: int
    parameters: bytes
    intact: bool  # Whether its CRC fits


class FrameParser:
    """Cuts a byte stream into instructions, skipping noise between them."""

    ANSWER: int | None = STATUS  # Code of another servo's answer, which is no instruction

    def __init__(self) -> None:
        self._bytes = bytearray()

    def feed(self, data: bytes) -> list[Instruction]:
        """Take bytes in and return the instructions that they complete."""
        self._bytes += data
        found: list[Instruction] = []
        while (instruction := self._next()) is not None:
            if instruction.code != self.ANSWER:
                found.append(instruction)
        return found

    def _next(self) -> Instruction | None:
        stream = self._bytes
        while True:
            start = stream.find(HEADER)
            if start < 0:
                del stream[: max(0, len(stream) - len(HEADER) + 1)]
                return None
            del stream[:start]
            if len(stream) < 7:
                return None
            length = int.from_bytes(stream[5:7], "little")
            if 3 <= length <= LONGEST_FRAME:
                break
            del stream[:1]  # no frame has such a length: this was no header
        end = 7 + length
        if len(stream) < end:
            return None
        packet = bytes(stream[:end])
        intact = crc16(packet[:-2]) == int.from_bytes(packet[-2:], "little")
        del stream[: end if intact else 4]  # a frame cut short may hide the next one's header
        body = unstuffed(packet[7:-2])
        return Instruction(identifier=packet[4], code=body[0], parameters=body[1:], intact=intact)

    def reset(self) -> None:
        """Forget a frame that never ended."""
        self._bytes.clear()
