"""The servo's memory: bytes, checks on writing, and the values that its loop reads every tick."""

from tendon_hardware.virtual_bench.memory import control_table as at
from tendon_hardware.virtual_bench.memory.control_table import (
    COUNTS_PER_TURN,
    GOALS,
    TABLE_SIZE,
    ServoModel,
    TableRegister,
    register_table,
)
from tendon_hardware.virtual_bench.memory.protocol import (
    BAD_LENGTH,
    BAD_RANGE,
    BEYOND_LIMIT,
    NO_ACCESS,
)

CURRENT, VELOCITY, POSITION, EXTENDED, CURRENT_POSITION, PWM = 0, 1, 3, 4, 5, 16
MODES = (CURRENT, VELOCITY, POSITION, EXTENDED, CURRENT_POSITION, PWM)
"""Values of the operating mode."""
WATCHDOG_TRIPPED = 0xFF


class Registers:
    """A control table with the e-manual's rules of access.

    EEPROM is locked while torque is on (error 7), and so are registers that only the servo writes.
    A value outside the register's range is error 4, outside a limit that another register sets
    error 6. Part of a register is error 5. A block is written whole or not at all.
    """

    def __init__(self, model: ServoModel) -> None:
        self.model = model
        self._table = register_table(model)
        self._bytes = bytearray(TABLE_SIZE)
        for register in self._table.values():
            self.store(register.address, register.initial)
        self._base = 0
        self.power_up(0)

    def power_up(self, count: int) -> None:
        """Reset the RAM as after power-on; the position starts within one turn.

        Args:
            count: What the encoder counts, turns included.
        """
        for register in self._table.values():
            if not register.in_eeprom:
                self.store(register.address, register.initial)
        self._base = count - count % COUNTS_PER_TURN
        self.reset_goals(self.turned(count))
        self._cache()

    def reset_goals(self, position: int) -> None:
        """Set the goals to standing still at a position [counts]."""
        self.store(at.GOAL_POSITION, position)
        self.store(
            at.GOAL_PWM, 0 if self.value(at.OPERATING_MODE) == PWM else self.value(at.PWM_LIMIT)
        )

    def turned(self, count: int) -> int:
        """Return the encoder's count with the turns since power-on [counts]."""
        if self.value(at.OPERATING_MODE) == POSITION and not self.value(at.TORQUE_ENABLE):
            return count % COUNTS_PER_TURN
        return count - self._base

    def value(self, address: int) -> int:
        """Return one register's value, signed where it is."""
        register = self._table[address]
        raw = self._bytes[address : address + register.size]
        return int.from_bytes(raw, "little", signed=register.signed)

    def store(self, address: int, value: int) -> None:
        """Put a value into a register, as the servo itself does."""
        size = self._table[address].size
        self._bytes[address : address + size] = (value & ((1 << 8 * size) - 1)).to_bytes(
            size, "little"
        )

    def read(self, address: int, length: int) -> bytes | None:
        """Return a block, or ``None`` where it leaves the table."""
        if length < 1 or address + length > TABLE_SIZE:
            return None
        return bytes(self._bytes[address : address + length])

    def write(self, address: int, data: bytes, position: int) -> int:
        """Write a block and return 0 or the error code.

        Args:
            position: Present position [counts], where goals start when torque comes on.
        """
        if not data or address + len(data) > TABLE_SIZE:
            return BAD_RANGE
        writes: list[tuple[TableRegister, int]] = []
        k = 0
        while k < len(data):
            register = self._table.get(address + k)
            if register is None or not register.writable:
                return NO_ACCESS
            chunk = data[k : k + register.size]
            if len(chunk) < register.size:
                return BAD_LENGTH
            value = int.from_bytes(chunk, "little", signed=register.signed)
            if error := self._fault(register, value):
                return error
            writes.append((register, value))
            k += register.size
        for register, value in writes:
            self._put(register, value, position)
        self._cache()
        return 0

    def _fault(self, register: TableRegister, value: int) -> int:
        """Return the error of writing a value, 0 for none."""
        address = register.address
        if register.in_eeprom and self.value(at.TORQUE_ENABLE):
            return NO_ACCESS
        if not register.low <= value <= register.high:
            return BAD_RANGE
        if address == at.OPERATING_MODE and value not in MODES:
            return BAD_RANGE
        if self.watchdog == WATCHDOG_TRIPPED and (
            address in GOALS or (address == at.BUS_WATCHDOG and value)
        ):
            return BAD_RANGE
        if (
            address == at.TORQUE_ENABLE
            and value
            and self.value(at.HARDWARE_ERROR) & self.value(at.SHUTDOWN)
        ):
            return NO_ACCESS  # shut down: only a reboot helps
        if address == at.GOAL_PWM and abs(value) > self.value(at.PWM_LIMIT):
            return BEYOND_LIMIT
        return 0

    def _put(self, register: TableRegister, value: int, position: int) -> None:
        """Store a checked value and what follows from it."""
        rising = register.address == at.TORQUE_ENABLE and value and not self.value(at.TORQUE_ENABLE)
        self.store(register.address, value)
        if rising:
            self.reset_goals(position)
        if register.address == at.OPERATING_MODE:  # gains and goals start anew in another mode
            self.reset_goals(position)

    def trip_watchdog(self, position: int) -> None:
        """Stop and lock the goals until the watchdog is written to 0."""
        self.store(at.BUS_WATCHDOG, WATCHDOG_TRIPPED)
        self.store(at.GOAL_POSITION, position)
        if self.value(at.OPERATING_MODE) == PWM:
            self.store(at.GOAL_PWM, 0)
        self._cache()

    def raise_error(self, bit: int) -> None:
        """Latch a hardware error; torque goes off where the shutdown mask says so."""
        self.store(at.HARDWARE_ERROR, self.value(at.HARDWARE_ERROR) | bit)
        if bit & self.value(at.SHUTDOWN):
            self.store(at.TORQUE_ENABLE, 0)
        self._cache()

    def _cache(self) -> None:
        """Keep what the loop reads each tick as plain numbers."""
        value = self.value
        self.torque = bool(value(at.TORQUE_ENABLE))
        self.mode = value(at.OPERATING_MODE)
        self.reversed = bool(value(at.DRIVE_MODE) & 1)
        self.pwm_limit = value(at.PWM_LIMIT)
        self.pwm_slope = value(at.PWM_SLOPE) * self.model.pwm_slope_unit
        self.temperature_limit = float(value(at.TEMPERATURE_LIMIT))
        self.voltage_window = (0.1 * value(at.MIN_VOLTAGE), 0.1 * value(at.MAX_VOLTAGE))
        self.watchdog = value(at.BUS_WATCHDOG)
        self.goal_pwm = value(at.GOAL_PWM)
