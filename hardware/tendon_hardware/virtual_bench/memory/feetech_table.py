"""Memory of Feetech's STS servos: what stands where, and within which range.

Source: Feetech, memory table of the SMS and STS servos. Where it is silent the comment says what is
assumed.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

from tendon_hardware.virtual_bench.memory.control_table import TableRegister

MODEL, IDENTIFIER, BAUD_RATE, RETURN_DELAY, RESPONSE_LEVEL = 3, 5, 6, 7, 8
MAX_TEMPERATURE, MAX_VOLTAGE, MIN_VOLTAGE, MAX_TORQUE = 13, 14, 15, 16
PHASE, UNLOADING = 18, 19
P_GAIN, D_GAIN, STARTING_FORCE, DEAD_ZONE_CW, DEAD_ZONE_CCW = 21, 22, 24, 26, 27
MODE, PROTECTIVE_TORQUE, PROTECTION_TIME, OVERLOAD_TORQUE = 33, 34, 35, 36
TORQUE_ENABLE, ACCELERATION, GOAL_POSITION, GOAL_PWM, GOAL_SPEED = 40, 41, 42, 44, 46
TORQUE_LIMIT, LOCK = 48, 55
POSITION, SPEED, LOAD, VOLTAGE, TEMPERATURE, STATUS, MOVING = 56, 58, 60, 62, 63, 65, 66
CURRENT = 69
FINE_SPEED = 4
"""Bit of the phase with which a count of speed is a count of position a second; else 50."""
FIRST_RAM_ADDRESS = 40
TABLE_SIZE = 87
SIGN_BITS = {
    GOAL_POSITION: 15,
    GOAL_PWM: 10,
    GOAL_SPEED: 15,
    POSITION: 15,
    SPEED: 15,
    LOAD: 10,
    CURRENT: 15,
}
"""Bits that make the number below them negative."""
FEETECH_ALERTS = {
    "input_voltage": 0x01,
    "encoder": 0x02,
    "overheating": 0x04,
    "electrical": 0x08,
    "overload": 0x20,
}
"""Bits of the status, by the words for a planned alert."""


@dataclass(frozen=True, kw_only=True, slots=True)
class FeetechModel:
    """Values that differ between servos of the series."""

    name: str
    number: int
    voltage_limits: tuple[int, int] = (140, 40)
    """Highest and lowest input voltage at the factory [0.1 V]."""
    position_gain: int = 32
    alert_bits: Mapping[str, int] = field(default_factory=lambda: FEETECH_ALERTS)


STS3215 = FeetechModel(name="sts3215", number=777)
STS3250 = FeetechModel(name="sts3250", number=2825)


def feetech_table(model: FeetechModel) -> dict[int, TableRegister]:
    """Return a servo's registers by address."""
    most, least = model.voltage_limits
    rows = [
        TableRegister(address=0, size=1, writable=False, initial=3),
        TableRegister(address=1, size=1, writable=False, initial=10),
        TableRegister(address=MODEL, size=2, writable=False, initial=model.number),
        TableRegister(address=IDENTIFIER, size=1, initial=1, high=253),
        TableRegister(address=BAUD_RATE, size=1, high=7),
        TableRegister(address=RETURN_DELAY, size=1, initial=250, high=254),
        TableRegister(address=RESPONSE_LEVEL, size=1, initial=1, high=1),
        TableRegister(address=9, size=2, high=4095),
        TableRegister(address=11, size=2, initial=4095, high=4095),
        TableRegister(address=MAX_TEMPERATURE, size=1, initial=70, high=100),
        TableRegister(address=MAX_VOLTAGE, size=1, initial=most, high=254),
        TableRegister(address=MIN_VOLTAGE, size=1, initial=least, high=254),
        TableRegister(address=MAX_TORQUE, size=2, initial=1000, high=1000),
        TableRegister(
            address=PHASE, size=1, initial=12, high=254
        ),  # fine speed, which 0 does not limit
        TableRegister(address=UNLOADING, size=1, initial=0x2C, high=254),
        TableRegister(address=20, size=1, initial=0x2F, high=254),
        TableRegister(address=P_GAIN, size=1, initial=model.position_gain, high=254),
        TableRegister(address=D_GAIN, size=1, initial=32, high=254),
        TableRegister(address=23, size=1, high=254),
        TableRegister(address=STARTING_FORCE, size=1, initial=16, high=254),
        TableRegister(address=25, size=1, high=254),
        TableRegister(address=DEAD_ZONE_CW, size=1, initial=1, high=32),
        TableRegister(address=DEAD_ZONE_CCW, size=1, initial=1, high=32),
        TableRegister(address=28, size=2, initial=511, high=2047),
        TableRegister(address=30, size=1, initial=1, low=1, high=128),
        TableRegister(address=31, size=2, high=0xFFFF),
        TableRegister(address=MODE, size=1, high=3),
        TableRegister(address=PROTECTIVE_TORQUE, size=1, initial=20, high=100),
        TableRegister(address=PROTECTION_TIME, size=1, initial=200, high=254),
        TableRegister(address=OVERLOAD_TORQUE, size=1, initial=80, high=100),
        TableRegister(address=37, size=1, initial=10, high=254),
        TableRegister(address=38, size=1, initial=200, high=254),
        TableRegister(address=39, size=1, initial=10, high=254),
        TableRegister(address=TORQUE_ENABLE, size=1, high=128),
        TableRegister(address=ACCELERATION, size=1, high=254),
        TableRegister(address=GOAL_POSITION, size=2, high=0xFFFF),
        TableRegister(address=GOAL_PWM, size=2, high=0x7FF),
        TableRegister(address=GOAL_SPEED, size=2, high=0xFFFF),
        TableRegister(address=TORQUE_LIMIT, size=2, initial=1000, high=1000),
        TableRegister(address=LOCK, size=1, initial=1, high=1),
        *(
            TableRegister(address=a, size=2, writable=False)
            for a in (POSITION, SPEED, LOAD, CURRENT)
        ),
        *(
            TableRegister(address=a, size=1, writable=False)
            for a in (VOLTAGE, TEMPERATURE, 64, STATUS, MOVING)
        ),
        TableRegister(address=67, size=2, writable=False),
        TableRegister(address=84, size=1, writable=False, initial=68),
        TableRegister(address=85, size=1, writable=False, initial=254),
    ]
    return {row.address: row for row in rows}


class FeetechRegisters:
    """A memory with the manual's rules of access.

    What is written to the EEPROM while the lock is on lasts until the supply is switched off.
    Assumed: a value beyond a range is cut to it, and what nobody may write stays as it is; the
    protocol has no error for either.
    """

    def __init__(self, model: FeetechModel) -> None:
        self.model = model
        self._table = feetech_table(model)
        self._bytes = bytearray(TABLE_SIZE)
        self._kept: dict[int, int] = {}
        for register in self._table.values():
            self.keep(register.address, register.initial)
        self.power_up(0)

    def power_up(self, count: int) -> None:
        """Take what is kept, and reset the RAM.

        Args:
            count: What the encoder counts, of which this servo knows the place within a turn.
        """
        for register in self._table.values():
            kept = register.address < FIRST_RAM_ADDRESS
            self.store(register.address, self._kept[register.address] if kept else register.initial)
        self.store(TORQUE_LIMIT, self.value(MAX_TORQUE))
        self.store(GOAL_POSITION, count % 4096)

    def value(self, address: int) -> int:
        """Return one register's value, signed where it is."""
        size = self._table[address].size
        raw = int.from_bytes(self._bytes[address : address + size], "little")
        bit = SIGN_BITS.get(address)
        if bit is None:
            return raw
        return (raw & ((1 << bit) - 1)) * (-1 if raw >> bit & 1 else 1)

    def store(self, address: int, value: int) -> None:
        """Put a value into a register, as the servo itself does."""
        size, bit = self._table[address].size, SIGN_BITS.get(address)
        if bit is not None:
            value = min(abs(value), (1 << bit) - 1) | (value < 0) << bit
        self._bytes[address : address + size] = (value & ((1 << 8 * size) - 1)).to_bytes(
            size, "little"
        )

    def keep(self, address: int, value: int) -> None:
        """Put a value into a register so that it outlasts the supply."""
        self._kept[address] = value
        self.store(address, value)

    def read(self, address: int, length: int) -> bytes:
        """Return a block; behind the table there are zeros."""
        return bytes(self._bytes[address : address + length].ljust(length, b"\0"))

    def write(self, address: int, data: bytes) -> None:
        """Write a block."""
        place = 0
        while place < len(data):
            register = self._table.get(address + place)
            if register is None:
                place += 1
                continue
            chunk = data[place : place + register.size]
            place += register.size
            if register.writable and len(chunk) == register.size:
                self._put(register, int.from_bytes(chunk, "little"))

    def _put(self, register: TableRegister, value: int) -> None:
        address = register.address
        cut = min(max(value, register.low), register.high)
        self._bytes[address : address + register.size] = cut.to_bytes(register.size, "little")
        if address < FIRST_RAM_ADDRESS and not self.value(LOCK):
            self._kept[address] = cut
        if address == TORQUE_ENABLE:
            self.store(STATUS, self.value(STATUS) & ~FEETECH_ALERTS["overload"])

    def raise_error(self, bit: int) -> None:
        """Report an error; the motor goes off where the unloading condition says so."""
        self.store(STATUS, self.value(STATUS) | bit)
        if bit & self.value(UNLOADING) & ~FEETECH_ALERTS["overload"]:
            self.store(TORQUE_ENABLE, 0)
