"""The control loop of a Feetech STS servo and its protection, once a millisecond.

Source: Feetech, memory table of the STS servos. The gain is that which Rhoban/bam saw on an
oscilloscope: full duty at 4000 / P counts. Where both are silent the comment says what is assumed.
Speed and step mode are not emulated: the motor gets nothing in them.
"""

from math import copysign

from tendon_hardware.virtual_bench.emulation.firmware import TICK, profile_rate
from tendon_hardware.virtual_bench.memory import feetech_table as at
from tendon_hardware.virtual_bench.memory.feetech_table import FEETECH_ALERTS, FeetechRegisters
from tendon_hardware.virtual_bench.physics.encoder import Encoder
from tendon_hardware.virtual_bench.physics.motor import Motor

TURN = 4096
FULL = 1000  # Register value of full duty
POSITION_MODE, PWM_MODE = 0, 2
GAIN = 1.0 / 4000.0  # Duty of a count of error at a gain of 1 [1]
ACCELERATION_UNIT = 100.0  # Unit of the acceleration [counts/s^2]


class FeetechFirmware:
    """Turns goals into duty and watches voltage, warmth and load; nothing watches the bus."""

    def __init__(self, registers: FeetechRegisters, motor: Motor, encoder: Encoder) -> None:
        self._registers = registers
        self._motor = motor
        self._encoder = encoder
        self.silent = 0.0  # [s] since the last instruction; it decides nothing here
        self._overload = 0.0  # [s] at much duty
        self._side = 0.0  # of the overload that is cut; 0 where none is
        self._target = 0.0
        self._target_rate = 0.0

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
            self._target, self._target_rate = float(self.position), 0.0
            return
        motor.enabled = True
        mode = registers.value(at.MODE)
        wanted = 0.0
        if mode == PWM_MODE:
            wanted = registers.value(at.GOAL_PWM) / FULL
        elif mode == POSITION_MODE:
            wanted = self._position_duty()
        limit = registers.value(at.TORQUE_LIMIT) / FULL
        motor.duty = self._protected(max(-limit, min(limit, wanted)))

    def _position_duty(self) -> float:
        """Return the position loop's duty [1]; assumed: D acts on the speed of one tick."""
        registers = self._registers
        self._follow_profile()
        error = self._target - self.position
        zone = at.DEAD_ZONE_CW if error > 0.0 else at.DEAD_ZONE_CCW
        if abs(error) <= registers.value(zone):
            return 0.0
        start = copysign(registers.value(at.STARTING_FORCE) / FULL, error)
        return GAIN * registers.value(at.P_GAIN) * error + start

    def _follow_profile(self) -> None:
        """Move the target: at once without an acceleration and a speed, else by a trapezoid."""
        registers = self._registers
        goal = float(registers.value(at.GOAL_POSITION))
        top = abs(registers.value(at.GOAL_SPEED)) or float("inf")
        acceleration = ACCELERATION_UNIT * registers.value(at.ACCELERATION)
        left = goal - self._target
        rate = profile_rate(self._target_rate, left, top, acceleration)
        if abs(left) <= abs(rate) * TICK:
            self._target, self._target_rate = goal, 0.0
            return
        self._target += rate * TICK
        self._target_rate = rate

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
