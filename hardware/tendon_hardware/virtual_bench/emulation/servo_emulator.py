"""The servo's side of the bus: instructions in, status frames out."""

from tendon_hardware.virtual_bench.emulation.emulated_servo import EmulatedServo
from tendon_hardware.virtual_bench.memory import control_table as at
from tendon_hardware.virtual_bench.memory.control_table import (
    CURRENT_UNIT,
    PWM_FULL,
    VELOCITY_UNIT,
    VOLTAGE_UNIT,
)
from tendon_hardware.virtual_bench.memory.protocol import (
    ACTION,
    ALERT,
    BAD_CRC,
    BAD_LENGTH,
    BAD_RANGE,
    BROADCAST,
    BULK_READ,
    BULK_WRITE,
    FACTORY_RESET,
    FAIL,
    PING,
    READ,
    REBOOT,
    REG_WRITE,
    SYNC_READ,
    SYNC_WRITE,
    UNKNOWN_INSTRUCTION,
    WRITE,
    Instruction,
    status_frame,
)


class ServoEmulator(EmulatedServo):
    """Answers Protocol 2.0 instructions from the registers."""

    BAUD_RATES = (9_600, 57_600, 115_200, 1_000_000, 2_000_000, 3_000_000, 4_000_000)
    IDENTIFIER = at.IDENTIFIER
    _pending: tuple[int, bytes] | None = None

    def answer(self, instruction: Instruction, time: float, count: int) -> bytes:
        """Carry out an instruction and return the answer, empty where there is none.

        Args:
            time: Now [s].
        """
        ours = instruction.identifier in (self.identifier, BROADCAST)
        if time < self._silent_until or not ours:
            return b""
        if not instruction.intact:
            return self._status(BAD_CRC) if instruction.identifier != BROADCAST else b""
        self._firmware.silent = 0.0
        if instruction.code in (PING, READ, SYNC_READ, BULK_READ):
            self._refresh(time)
        return self._carry_out(instruction, time, count)

    def _carry_out(self, instruction: Instruction, time: float, count: int) -> bytes:
        """Carry out an intact instruction that is for this servo."""
        code, data = instruction.code, instruction.parameters
        quiet = instruction.identifier == BROADCAST
        level = self._registers.value(at.STATUS_RETURN_LEVEL)
        if code == PING:
            return self._status(
                0,
                self._registers.read(at.MODEL_NUMBER, 2),
                self._registers.read(at.FIRMWARE_VERSION, 1),
            )
        if code in (SYNC_READ, BULK_READ):
            return self._group_read(code, data) if level >= 1 else b""
        if code in (SYNC_WRITE, BULK_WRITE):
            self._group_write(code, data)
            return b""
        if code == READ:
            return self._read(data) if level >= 1 and not quiet else b""
        error = self._command(code, data, time, count)
        return b"" if quiet or level < 2 else self._status(error)

    def _command(self, code: int, data: bytes, time: float, count: int) -> int:
        """Carry out what only has an error for an answer."""
        if code == WRITE:
            return self._write(data)
        if code == REG_WRITE:
            if len(data) < 3:
                return BAD_LENGTH
            self._pending = (int.from_bytes(data[:2], "little"), data[2:])
            self._registers.store(at.REGISTERED_INSTRUCTION, 1)
            return 0
        if code == ACTION:
            if self._pending is None:
                return FAIL
            address, block = self._pending
            self._pending = None
            self._registers.store(at.REGISTERED_INSTRUCTION, 0)
            return self._registers.write(address, block, self._firmware.position)
        if code == REBOOT:
            self.restart(time, count)
            return 0
        # a factory reset would change the servo's id and speed: refused
        return FAIL if code == FACTORY_RESET else UNKNOWN_INSTRUCTION

    def restart(self, time: float, count: int) -> None:
        """Lose the RAM, a write that waits included, and be silent for a while."""
        super().restart(time, count)
        self._pending = None

    def _read(self, data: bytes) -> bytes:
        if len(data) != 4:
            return self._status(BAD_LENGTH)
        block = self._registers.read(
            int.from_bytes(data[:2], "little"), int.from_bytes(data[2:], "little")
        )
        return self._status(BAD_RANGE) if block is None else self._status(0, block)

    def _write(self, data: bytes) -> int:
        if len(data) < 3:
            return BAD_LENGTH
        address = int.from_bytes(data[:2], "little")
        return self._registers.write(address, data[2:], self._firmware.position)

    def _group_read(self, code: int, data: bytes) -> bytes:
        """Answer a sync or bulk read when this servo is on its list."""
        if code == SYNC_READ:
            return self._read(data[:4]) if self.identifier in data[4:] else b""
        for k in range(0, len(data) - 4, 5):
            if data[k] == self.identifier:
                return self._read(data[k + 1 : k + 5])
        return b""

    def _group_write(self, code: int, data: bytes) -> None:
        """Take this servo's share of a sync or bulk write."""
        if code == SYNC_WRITE:
            length = int.from_bytes(data[2:4], "little")
            for k in range(4, len(data) - length, length + 1):
                if data[k] == self.identifier:
                    self._write(data[:2] + data[k + 1 : k + 1 + length])
            return
        k = 0
        while k + 5 <= len(data):
            length = int.from_bytes(data[k + 3 : k + 5], "little")
            if data[k] == self.identifier:
                self._write(data[k + 1 : k + 3] + data[k + 5 : k + 5 + length])
            k += 5 + length

    def _status(self, error: int, *blocks: bytes | None) -> bytes:
        alert = ALERT if self._registers.value(at.HARDWARE_ERROR) else 0
        data = b"".join(block for block in blocks if block is not None)
        return status_frame(self.identifier, error | alert, data)

    def _refresh(self, time: float) -> None:
        """Put what the servo measures into its registers."""
        registers, motor = self._registers, self._motor
        sign = -1 if registers.reversed else 1
        rate = sign * self._firmware.rate
        target, target_rate = self._firmware.trajectory
        position = self._firmware.position
        scatter, voltage = self._measured()
        current = sign * motor.input_current + scatter
        clock = 1e3 * (1.0 + self._constants.clock_error)  # [1/s] ticks of register 120
        moving = abs(rate) > registers.value(at.MOVING_THRESHOLD) * VELOCITY_UNIT
        store = registers.store
        store(at.REALTIME_TICK, int(time * clock) % 32_768)
        store(at.MOVING, int(moving))
        store(at.MOVING_STATUS, 0x01 if abs(target - position) < 20 else 0x00)
        store(at.PRESENT_PWM, round(sign * motor.duty * PWM_FULL))
        store(at.PRESENT_CURRENT, round(current / CURRENT_UNIT))
        store(at.PRESENT_VELOCITY, round(rate / VELOCITY_UNIT))
        store(at.PRESENT_POSITION, position)
        store(at.VELOCITY_TRAJECTORY, round(target_rate / VELOCITY_UNIT))
        store(at.POSITION_TRAJECTORY, round(target))
        store(at.INPUT_VOLTAGE, max(0, round(voltage / VOLTAGE_UNIT)))
        store(at.TEMPERATURE, round(motor.temperature))
