"""The control loop of a Feetech STS servo and its protection, once a millisecond.

Source: Feetech, memory table of the STS servos. Where it is silent the comment says what is
assumed. Our driver sends duties: in other modes than PWM the motor gets nothing.
"""

from math import copysign

from tendon_hardware.virtual_bench.emulation.firmware import TICK
from tendon_hardware.virtual_bench.memory import feetech_table as at
from tendon_hardware.virtual_bench.memory.feetech_table import FEETECH_ALERTS, FeetechRegisters
from tendon_hardware.virtual_bench.physics.encoder import Encoder
from tendon_hardware.virtual_bench.physics.motor import Motor

TURN = 4096
FULL = 1000  # Register value of full duty
PWM_MODE = 2


class FeetechFirmware:
    """Turns goals into duty and watches voltage, warmth and load; nothing watches the bus."""

    def __init__(self, registers: FeetechRegisters, motor: Motor, encoder: Encoder) -> None:
        self._registers = registers
        self._motor = motor
        self._encoder = encoder
        self.silent = 0.0  # [s] since the last instruction; it decides nothing here
        self._overload = 0.0  # [s] at much duty
        self._side = 0.0  # of the overload that is cut; 0 where none is

    @property
    def position(self) -> int:
        """Present position within a turn [counts]."""
        return self._encoder.count % TURN

    @property
    def rate(self) -> float:
        """Speed as the firmware sees it, late and filtered [rad/s]."""
        return self._encoder.rate

    def tick(self) -> None:
        """Run the loop once."""
        registers, motor = self._registers, self._motor
        self._encoder.read(motor.angle)
        if registers.value(at.TORQUE_ENABLE) != 1:
            motor.enabled = False
            motor.duty = self._overload = self._side = 0.0
            return
        motor.enabled = True
        sends = registers.value(at.MODE) == PWM_MODE
        wanted = registers.value(at.GOAL_PWM) / FULL if sends else 0.0
        limit = registers.value(at.TORQUE_LIMIT) / FULL
        motor.duty = self._protected(max(-limit, min(limit, wanted)))

    def _protected(self, wanted: float) -> float:
        """Return a duty cut by the overload protection, which a demand of the other side ends."""
        registers = self._registers
        if self._side * wanted < 0.0:
            self._side = self._overload = 0.0
            registers.store(at.STATUS, registers.value(at.STATUS) & ~FEETECH_ALERTS["overload"])
        if abs(wanted) >= registers.value(at.OVERLOAD_TORQUE) / 100.0:
            self._overload += TICK
        else:
            self._overload = 0.0
        late = self._overload > 0.01 * registers.value(at.PROTECTION_TIME)
        if not self._side and late and registers.value(at.UNLOADING) & FEETECH_ALERTS["overload"]:
            self._side = copysign(1.0, wanted)
            registers.raise_error(FEETECH_ALERTS["overload"])
        if not self._side:
            return wanted
        bound = registers.value(at.PROTECTIVE_TORQUE) / 100.0
        return max(-bound, min(bound, wanted))

    def protect(self, duration: float) -> None:
        """Look after voltage and warmth; call it every few milliseconds [s]."""
        registers, motor = self._registers, self._motor
        low, high = registers.value(at.MIN_VOLTAGE), registers.value(at.MAX_VOLTAGE)
        if not low <= 10.0 * motor.voltage <= high:
            registers.raise_error(FEETECH_ALERTS["input_voltage"])
        if motor.temperature > registers.value(at.MAX_TEMPERATURE):
            registers.raise_error(FEETECH_ALERTS["overheating"])
