"""The servo's control loop and its protection, once a millisecond.

Source: ROBOTIS e-manual, XC330-T288-T: position PWM = P/128 counts + I/65536 sum + D/16
difference; velocity current = P/128 steps + I/65536 sum, both in register units. Where the manual
is silent the comment says what is assumed.
"""

from math import copysign, pi

from tendon_hardware.virtual_bench.memory.control_table import CURRENT_UNIT, PWM_FULL, VELOCITY_UNIT
from tendon_hardware.virtual_bench.memory.registers import (
    CURRENT,
    EXTENDED,
    POSITION,
    PWM,
    VELOCITY,
    WATCHDOG_TRIPPED,
    Registers,
)
from tendon_hardware.virtual_bench.physics.encoder import COUNTS_PER_RADIAN, Encoder
from tendon_hardware.virtual_bench.physics.motor import Motor

TICK = 1e-3  # Period of the firmware's loop [s]
INPUT_VOLTAGE, OVERHEATING, OVERLOAD = 0x01, 0x04, 0x20  # Hardware errors that it raises by itself

OVERLOAD_DUTY = 0.97  # assumed: the motor stands while nearly all of the voltage is on it
OVERLOAD_SPEED = 0.05  # [rad/s]
OVERLOAD_TIME = 4.0  # [s]
CURRENT_LOOP_GAIN = 0.35  # assumed: duty per ampere of error and tick, for the current modes
ACCELERATION_UNIT = 214.577 * 2.0 * pi / 3600.0  # [rad/s^2]


class Firmware:
    """Turns goals into duty and watches voltage, warmth, load and the bus."""

    def __init__(self, registers: Registers, motor: Motor, encoder: Encoder) -> None:
        self._registers = registers
        self._motor = motor
        self._encoder = encoder
        self.silent = 0.0  # [s] since the last instruction
        self._running = False
        self._restart()

    def _restart(self) -> None:
        """Forget what a running loop remembers."""
        self._integral = 0.0
        self._last_error = 0.0
        self._overload = 0.0
        self._target = float(self.position)
        self._target_rate = 0.0

    @property
    def position(self) -> int:
        """Present position [counts], homing offset and direction included."""
        registers = self._registers
        count = registers.turned(self._encoder.count)
        return (-count if registers.reversed else count) + registers.homing_offset

    @property
    def rate(self) -> float:
        """Speed as the firmware sees it, late and filtered [rad/s]."""
        return self._encoder.rate

    @property
    def trajectory(self) -> tuple[float, float]:
        """Where a profile now wants the shaft [counts] and how fast [rad/s]."""
        return self._target, self._target_rate

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
            self._restart()
            self._running = motor.enabled = True
        self._watch_bus()
        mode = registers.mode
        if mode == PWM:
            wanted = registers.goal_pwm / PWM_FULL
        elif mode in (POSITION, EXTENDED):
            limit = min(registers.pwm_limit, abs(registers.goal_pwm)) / PWM_FULL
            wanted = max(-limit, min(limit, self._position_duty()))
        elif mode == VELOCITY:
            wanted = self._velocity_duty(registers.goal_velocity)
        elif mode == CURRENT:
            wanted = self._current_duty(registers.goal_current * CURRENT_UNIT)
        else:
            wanted = self._bounded_position_duty()
        ceiling = registers.pwm_limit / PWM_FULL
        wanted = max(-ceiling, min(ceiling, wanted))
        if registers.reversed:
            wanted = -wanted
        step = registers.pwm_slope * TICK / motor.supply if motor.supply > 1.0 else 1.0
        change = wanted - motor.duty
        motor.duty += change if -step < change < step else copysign(step, change)

    def _position_duty(self) -> float:
        """Return the position loop's duty [1]."""
        registers = self._registers
        self._follow_profile()
        error = self._target - self.position
        if registers.position_i:
            self._integral += error
            bound = 65536.0 * PWM_FULL / registers.position_i
            self._integral = max(-bound, min(bound, self._integral))
        change = error - self._last_error
        self._last_error = error
        pwm = (
            registers.position_p * error / 128.0
            + registers.position_i * self._integral / 65536.0
            + registers.position_d * change / 16.0
        )
        return pwm / PWM_FULL

    def _follow_profile(self) -> None:
        """Move the target: at once with a profile velocity of 0, else along a trapezoid."""
        registers = self._registers
        goal, top = float(registers.goal_position), registers.profile_velocity * VELOCITY_UNIT
        if not top:
            self._target, self._target_rate = goal, 0.0
            return
        counts = COUNTS_PER_RADIAN
        left = (goal - self._target) / counts
        acceleration = registers.profile_acceleration * ACCELERATION_UNIT
        rate = profile_rate(self._target_rate, left, top, acceleration)
        if abs(left) <= abs(rate) * TICK:
            self._target, self._target_rate = goal, 0.0
            return
        self._target += rate * TICK * counts
        self._target_rate = rate

    def _velocity_duty(self, goal: int) -> float:
        """Return the velocity loop's duty [1]; its output counts as full duty per 910 steps."""
        registers = self._registers
        rate = -self._encoder.rate if registers.reversed else self._encoder.rate
        error = goal - rate / VELOCITY_UNIT
        self._integral = max(-5e4, min(5e4, self._integral + error))
        out = registers.velocity_p * error / 128.0 + registers.velocity_i * self._integral / 65536.0
        return out / PWM_FULL

    def _current_duty(self, goal: float) -> float:
        """Return the duty that steers the input current to a goal [A]."""
        present = abs(self._motor.input_current)
        self._integral += CURRENT_LOOP_GAIN * TICK * 20.0 * (abs(goal) - present)
        self._integral = max(0.0, min(1.0, self._integral))
        return copysign(self._integral, goal) if goal else 0.0

    def _bounded_position_duty(self) -> float:
        """Return the position loop's duty, less where the current would pass its goal."""
        wanted = self._position_duty()
        bound = abs(self._registers.goal_current) * CURRENT_UNIT
        motor = self._motor
        # input current = duty times phase current; the loop backs off in proportion
        present = abs(motor.input_current)
        if present > bound and abs(wanted) >= abs(motor.duty):
            wanted = motor.duty * (bound / present) ** 0.5
        return wanted

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


def profile_rate(rate: float, left: float, top: float, acceleration: float) -> float:
    """Return the next rate of a target with some way left, no faster than can still be braked.

    Args:
        acceleration: Greatest change of the rate in a second; 0 is any.
    """
    if not acceleration:
        return copysign(top, left)
    bound = acceleration * TICK
    top = min(top, (2.0 * acceleration * abs(left)) ** 0.5 + bound)
    return rate + max(-bound, min(bound, copysign(top, left) - rate))
