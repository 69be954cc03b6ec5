"""Registers, and what a servo bus asks of a protocol: instructions out, answers in."""

from dataclasses import dataclass
from typing import Protocol


@dataclass(frozen=True, kw_only=True, slots=True)
class Register:
    """One number in a servo's control table."""

    name: str  # Name in the manual
    address: int  # Address of the first byte
    size: int  # Bytes, least significant first
    signed: bool = False  # Two's complement
    # Bit that makes the number below it negative; None where there is none
    sign_bit: int | None = None

    def decode(self, data: bytes) -> int:
        """Read the counts from this register's bytes."""
        counts = int.from_bytes(data, "little", signed=self.signed)
        if self.sign_bit is None:
            return counts
        magnitude = counts & ((1 << self.sign_bit) - 1)
        return -magnitude if counts >> self.sign_bit & 1 else magnitude

    def encode(self, counts: int) -> bytes:
        """Write counts into this register's bytes."""
        if self.sign_bit is not None:
            counts = abs(counts) | (counts < 0) << self.sign_bit
        return counts.to_bytes(self.size, "little", signed=self.signed)


SUCCESS = 0
SILENT = -3001  # Nothing came; the number is that of dynamixel_sdk
BROKEN = -3002  # Bytes came that are no whole answer


@dataclass(frozen=True, kw_only=True, slots=True)
class Answer:
    """A servo's answer that came whole."""

    identifier: int
    data: bytes
    alert: bool  # The servo reports that something has happened to it
    refusal: int = 0  # Why the instruction was not carried out; 0 where it was


class Packets(Protocol):
    """Instructions of a family of servos, each sent at once, and their answers.

    What sends returns 0, or a result that is no success.
    """

    ping_length: int
    """Bytes of data in the answer to a ping; the first two are the model number, where there are
    any."""

    def ping(self, identifier: int) -> int:
        """Ask whether a servo is there."""
        ...

    def read(self, identifier: int, address: int, length: int) -> int:
        """Ask for bytes."""
        ...

    def write(self, identifier: int, address: int, data: bytes) -> int:
        """Write bytes."""
        ...

    def receive(self) -> tuple[Answer | None, int]:
        """Wait for one answer, as long as the port was told; else say why there is none."""
        ...

    def find_all(self) -> dict[int, int]:
        """Return the model numbers of all servos at this rate, by ID."""
        ...

    def restart(self, identifier: int) -> None:
        """Restart a servo.

        Raises:
            ServoRefused: The family has no such instruction.
        """
