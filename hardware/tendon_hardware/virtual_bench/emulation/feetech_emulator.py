"""A Feetech servo's side of the bus: instructions in, answers out.

Frames are FF FF, ID, length, instruction or error, parameters, sum. Source: Feetech, communication
protocol of its SCS, STS and SMS servos.
"""

from math import pi

from tendon_hardware.virtual_bench.emulation.emulated_servo import EmulatedServo
from tendon_hardware.virtual_bench.emulation.feetech_firmware import FULL, TURN
from tendon_hardware.virtual_bench.memory import feetech_table as at
from tendon_hardware.virtual_bench.memory.protocol import FrameParser, Instruction

HEADER = b"\xff\xff"
BROADCAST = 0xFE
PING, READ, WRITE = 0x01, 0x02, 0x03


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


CURRENT_UNIT = 6.5e-3  # One step of the current [A]
COUNTS_PER_RADIAN = TURN / (2.0 * pi)


class FeetechEmulator(EmulatedServo):
    """Answers the instructions of Feetech's protocol from the registers."""

    BAUD_RATES = (1_000_000, 500_000, 250_000, 128_000, 115_200, 76_800, 57_600, 38_400)
    IDENTIFIER = at.IDENTIFIER

    def answer(self, instruction: Instruction, time: float, count: int) -> bytes:
        """Carry out an instruction and return the answer, empty where there is none.

        Args:
            time: Now [s].
            count: Present counts of the encoder; the firmware has its own.
        """
        del count
        quiet = instruction.identifier == BROADCAST
        ours = quiet or instruction.identifier == self.identifier
        if time < self._silent_until or not ours or not instruction.intact:
            return b""
        code, data = instruction.code, instruction.parameters
        if code == PING:
            return self._status()
        if code == READ and len(data) == 2 and not quiet:
            self._refresh()
            return self._status(self._registers.read(data[0], data[1]))
        if code != WRITE or len(data) < 2:
            return b""  # assumed: what it does not know it does not answer
        self._registers.write(data[0], data[1:])
        level = self._registers.value(at.RESPONSE_LEVEL)
        return self._status() if level and not quiet else b""

    def _status(self, data: bytes = b"") -> bytes:
        return status_frame(self.identifier, self._registers.value(at.STATUS), data)

    def _refresh(self) -> None:
        """Put what the servo measures into its registers."""
        registers, motor = self._registers, self._motor
        scatter, voltage = self._measured()
        speed = round(self._firmware.rate * COUNTS_PER_RADIAN)
        fine = registers.value(at.PHASE) & at.FINE_SPEED
        registers.store(at.POSITION, self._firmware.position)
        registers.store(at.SPEED, speed if fine else round(speed / 50.0))
        registers.store(at.LOAD, round(motor.duty * FULL))
        registers.store(at.VOLTAGE, max(0, round(10.0 * voltage)))
        registers.store(at.TEMPERATURE, round(motor.temperature))
        registers.store(at.MOVING, int(abs(speed) > 50))
        registers.store(at.CURRENT, round((motor.current + scatter) / CURRENT_UNIT))
