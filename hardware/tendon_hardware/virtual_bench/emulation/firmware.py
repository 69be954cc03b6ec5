"""The servo's control loop and its protection, once a millisecond.

Source: ROBOTIS e-manual, XC330-T288-T. Where the manual is silent the comment says what is assumed.
Our driver sends duties: in other modes than PWM the motor gets nothing.
"""

from math import copysign

from tendon_hardware.virtual_bench.memory.control_table import PWM_FULL
from tendon_hardware.virtual_bench.memory.registers import PWM, WATCHDOG_TRIPPED, Registers
from tendon_hardware.virtual_bench.physics.encoder import Encoder
from tendon_hardware.virtual_bench.physics.motor import Motor

TICK = 1e-3  # Period of the firmware's loop [s]
INPUT_VOLTAGE, OVERHEATING, OVERLOAD = 0x01, 0x04, 0x20  # Hardware errors that it raises by itself

OVERLOAD_DUTY = 0.97  # assumed: the motor stands while nearly all of the voltage is on it
OVERLOAD_SPEED = 0.05  # [rad/s]
OVERLOAD_TIME = 4.0  # [s]


class Firmware:
    """Turns goals into duty and watches voltage, warmth, load and the bus."""

    def __init__(self, registers: Registers, motor: Motor, encoder: Encoder) -> None:
        self._registers = registers
        self._motor = motor
        self._encoder = encoder
        self.silent = 0.0  # [s] since the last instruction
        self._running = False
        self._overload = 0.0  # [s] at full duty without a motion

    @property
    def position(self) -> int:
        """Present position [counts], direction included."""
        count = self._registers.turned(self._encoder.count)
        return -count if self._registers.reversed else count

    @property
    def rate(self) -> float:
        """Speed as the firmware sees it, late and filtered [rad/s]."""
        return self._encoder.rate

    def tick(self) -> None:
        """Run the loop once."""
        registers, motor = self._registers, self._motor
        self._encoder.read(motor.angle)
        if not registers.torque:
            motor.enabled = False
            motor.duty = 0.0
            self._running = False
            return
        if not self._running:
            self._overload = 0.0
            self._running = motor.enabled = True
        self._watch_bus()
        wanted = registers.goal_pwm / PWM_FULL if registers.mode == PWM else 0.0
        ceiling = registers.pwm_limit / PWM_FULL
        wanted = max(-ceiling, min(ceiling, wanted))
        if registers.reversed:
            wanted = -wanted
        step = registers.pwm_slope * TICK / motor.supply if motor.supply > 1.0 else 1.0
        change = wanted - motor.duty
        motor.duty += change if -step < change < step else copysign(step, change)

    def _watch_bus(self) -> None:
        """Trip the bus watchdog when no instruction came for as long as it allows."""
        self.silent += TICK
        registers = self._registers
        if 0 < registers.watchdog < WATCHDOG_TRIPPED and self.silent > 0.02 * registers.watchdog:
            registers.trip_watchdog(self.position)

    def protect(self, duration: float) -> None:
        """Look after voltage, warmth and load; call it every few milliseconds [s]."""
        registers, motor = self._registers, self._motor
        low, high = registers.voltage_window
        if not low <= motor.voltage <= high:
            registers.raise_error(INPUT_VOLTAGE)
        if motor.temperature > registers.temperature_limit:
            registers.raise_error(OVERHEATING)
        stalled = (
            motor.enabled
            and abs(motor.duty) > OVERLOAD_DUTY
            and abs(self._encoder.rate) < OVERLOAD_SPEED
        )
        self._overload = self._overload + duration if stalled else 0.0
        if self._overload > OVERLOAD_TIME:
            registers.raise_error(OVERLOAD)
