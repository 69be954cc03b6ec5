"""One number in a servo's memory: where it stands and how its bytes are read."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True, slots=True)
class Register:
    """One number in a servo's control table."""

    name: str
    """Name in the manual."""
    address: int
    """Address of the first byte."""
    size: int
    """Bytes, least significant first."""
    signed: bool = False
    """Two's complement."""
    sign_bit: int | None = None
    """Bit that makes the number below it negative; None where there is none."""

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
