"""Frames of Feetech's protocol: FF FF, ID, length, instruction or error, parameters, sum.

Source: Feetech, communication protocol of its SCS, STS and SMS servos.
"""

from tendon_hardware.virtual_bench.memory.protocol import FrameParser, Instruction

HEADER = b"\xff\xff"
BROADCAST = 0xFE
PING, READ, WRITE, SYNC_WRITE = 0x01, 0x02, 0x03, 0x83


def inverted_sum(body: bytes) -> int:
    """Return the check sum of all between header and sum."""
    return 0xFF - sum(body) % 256


def status_frame(identifier: int, error: int, parameters: bytes = b"") -> bytes:
    """Build a servo's answer."""
    body = bytes([identifier, len(parameters) + 2, error]) + parameters
    return HEADER + body + bytes([inverted_sum(body)])


class FeetechParser(FrameParser):
    """Cuts a byte stream into instructions, skipping noise between them."""

    ANSWER = None  # an answer has no code of its own here

    def _next(self) -> Instruction | None:
        stream = self._bytes
        while len(stream) >= 4:
            if not stream.startswith(HEADER) or stream[2] == 0xFF or stream[3] < 2:
                del stream[:1]
                continue
            end = 4 + stream[3]
            if len(stream) < end:
                return None
            packet = bytes(stream[:end])
            del stream[:end]
            return Instruction(
                identifier=packet[2],
                code=packet[4],
                parameters=packet[5:-1],
                intact=inverted_sum(packet[2:-1]) == packet[-1],
            )
        return None
