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
    ALERT,
    BAD_CRC,
    BAD_LENGTH,
    BAD_RANGE,
    BROADCAST,
    PING,
    READ,
    REBOOT,
    UNKNOWN_INSTRUCTION,
    WRITE,
    Instruction,
    status_frame,
)


class ServoEmulator(EmulatedServo):
    """Answers Protocol 2.0 instructions from the registers."""

    BAUD_RATES = (9_600, 57_600, 115_200, 1_000_000, 2_000_000, 3_000_000, 4_000_000)
    IDENTIFIER = at.IDENTIFIER

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
        if instruction.code in (PING, READ):
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
        if code == READ:
            return self._read(data) if level >= 1 and not quiet else b""
        error = self._command(code, data, time, count)
        return b"" if quiet or level < 2 else self._status(error)

    def _command(self, code: int, data: bytes, time: float, count: int) -> int:
        """Carry out what only has an error for an answer."""
        if code == WRITE:
            return self._write(data)
        if code == REBOOT:
            self.restart(time, count)
            return 0
        return UNKNOWN_INSTRUCTION

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

    def _status(self, error: int, *blocks: bytes | None) -> bytes:
        alert = ALERT if self._registers.value(at.HARDWARE_ERROR) else 0
        data = b"".join(block for block in blocks if block is not None)
        return status_frame(self.identifier, error | alert, data)

    def _refresh(self, time: float) -> None:
        """Put what the servo measures into its registers."""
        registers, motor = self._registers, self._motor
        sign = -1 if registers.reversed else 1
        rate = sign * self._firmware.rate
        scatter, voltage = self._measured()
        current = sign * motor.input_current + scatter
        clock = 1e3 * (1.0 + self._constants.clock_error)  # [1/s] ticks of register 120
        store = registers.store
        store(at.REALTIME_TICK, int(time * clock) % 32_768)
        store(at.PRESENT_PWM, round(sign * motor.duty * PWM_FULL))
        store(at.PRESENT_CURRENT, round(current / CURRENT_UNIT))
        store(at.PRESENT_VELOCITY, round(rate / VELOCITY_UNIT))
        store(at.PRESENT_POSITION, self._firmware.position)
        store(at.INPUT_VOLTAGE, max(0, round(voltage / VOLTAGE_UNIT)))
        store(at.TEMPERATURE, round(motor.temperature))
