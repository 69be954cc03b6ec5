"""The servo's side of the bus: instructions in, status frames out."""

from __future__ import annotations

import random

from hardware.virtual_bench.emulation.firmware import Firmware
from hardware.virtual_bench.memory import addresses as at
from hardware.virtual_bench.memory.control_table import (
    CURRENT_UNIT,
    PWM_FULL,
    VELOCITY_UNIT,
    VOLTAGE_UNIT,
)
from hardware.virtual_bench.memory.protocol import (
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
from hardware.virtual_bench.memory.registers import Registers
from hardware.virtual_bench.physics.constants import ServoConstants
from hardware.virtual_bench.physics.motor import Motor

BAUD_RATES = (9_600, 57_600, 115_200, 1_000_000, 2_000_000, 3_000_000, 4_000_000)
"""Baud rates by the value of register 8 [bit/s]."""
REBOOT_TIME = 0.25
"""Silence after a reboot [s]; assumed."""


class ServoEmulator:
    """Answers Protocol 2.0 instructions from the registers.

    Args:
        registers: The servo's memory.
        firmware: Its loop, for the present position and the silence that the bus watchdog counts.
        motor: Motor whose state the sensors read.
        constants: Constants of its sensors and its clock.
        rng: Source of the sensors' noise.
    """

    def __init__(
        self,
        registers: Registers,
        firmware: Firmware,
        motor: Motor,
        constants: ServoConstants,
        rng: random.Random,
    ) -> None:
        self._registers = registers
        self._firmware = firmware
        self._motor = motor
        self._constants = constants
        self._random = rng
        self._clock = 1e3 * (1.0 + constants.clock_error)  # [1/s] ticks of register 120
        self._pending: tuple[int, bytes] | None = None
        self._silent_until = 0.0
        self.instructions = 0
        """Number of instructions for this servo."""

    @property
    def identifier(self) -> int:
        """Address on the bus."""
        return self._registers.value(at.IDENTIFIER)

    @property
    def baud(self) -> int:
        """Speed that its port listens at [bit/s]."""
        return BAUD_RATES[self._registers.value(at.BAUD_RATE)]

    @property
    def return_delay(self) -> float:
        """Pause before an answer [s]."""
        return 2e-6 * self._registers.value(at.RETURN_DELAY)

    def answer(self, instruction: Instruction, time: float, count: int) -> bytes:
        """Carry out an instruction and return the answer, empty where there is none.

        Args:
            instruction: Instruction from the bus.
            time: Now [s].
            count: Present counts of the encoder.
        """
        ours = instruction.identifier in (self.identifier, BROADCAST)
        if time < self._silent_until or not ours:
            return b""
        if not instruction.intact:
            return self._status(BAD_CRC) if instruction.identifier != BROADCAST else b""
        self.instructions += 1
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
        """Lose the RAM, torque included, and be silent for a while."""
        self._registers.power_up(count)
        self._pending = None
        self._silent_until = time + REBOOT_TIME

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
        gauss, duty = self._random.gauss, abs(motor.duty)
        current = sign * motor.input_current + self._constants.current_noise * gauss(0.0, 1.0)
        # the converter samples within the PWM's period: steady at rest and at full duty only
        ripple = self._constants.voltage_ripple * min(1.0, 4.0 * duty * (1.0 - min(1.0, duty)))
        voltage = motor.voltage + ripple * gauss(0.0, 1.0)
        moving = abs(rate) > registers.value(at.MOVING_THRESHOLD) * VELOCITY_UNIT
        store = registers.store
        store(at.REALTIME_TICK, int(time * self._clock) % 32_768)
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
