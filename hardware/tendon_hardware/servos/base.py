"""Types between a servo and the rest: its data sheet, its state, health and settings."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import pi

VOLTAGE = "input voltage outside its limits"


def alert_words(bits: int, words: Mapping[int, str]) -> tuple[str, ...]:
    """Name the alerts of a servo, of whose family each bit has its word."""
    return tuple(words.get(bit, f"unknown alert, bit {bit}") for bit in range(8) if bits >> bit & 1)


@dataclass(frozen=True, kw_only=True, slots=True)
class ServoSpec:
    """One row of a data sheet: units of the registers, limits, and what the motor can do."""

    name: str  # Key in the table of servos
    model_number: int  # Model number in register 0
    position_unit: float  # Size of one count of position [rad]
    velocity_unit: float  # Size of one count of velocity [rad/s]
    current_unit: float  # Size of one count of current [A]
    voltage_unit: float = 0.1  # Size of one count of supply voltage [V]
    duty_counts: int  # Counts of full duty, 100 % of the supply voltage
    supply_voltage: float  # Voltage at which torque and speed hold [V]
    supply_range: tuple[float, float]  # Least and greatest supply voltage [V]
    # Torque at standstill and full duty [N m]; the e-manual advises a fifth for long loads
    stall_torque: float
    stall_current: float  # Supply current at that torque [A]
    no_load_speed: float  # Speed without load at full duty [rad/s]
    # Speed at which the winding's own voltage is all of the supply [rad/s]: no duty drives faster,
    # while gear and firmware keep the speed without load below it
    free_speed: float
    current_limit: float  # Greatest value of Current Limit (38) [A]
    temperature_limit: float = 70.0  # Temperature at which it shuts down [degC]
    position_gain: int  # Gain of the firmware's position loop after a restart, in its own unit
    # Rotor behind the gear, seen from the spool [kg m2]; no data sheet says it. This is the order
    # of a small one behind 288:1.
    armature: float = 0.002
    gear_yield: float = 0.65  # Share of that torque that likely reaches a string [1]
    family: str = "dynamixel"  # Key of its protocol and memory in the table of families

    @property
    def counts_per_turn(self) -> int:
        """Counts of one turn of the spool."""
        return round(2.0 * pi / self.position_unit)


@dataclass(frozen=True, kw_only=True, slots=True)
class ServoState:
    """Duty, current, velocity and position of one read: one instant."""

    time: float  # Middle of the transaction on the bench's clock [s]
    position: float  # Spool angle from home [rad], over several turns
    velocity: float  # Spool speed [rad/s]
    # Supply current [A]: of the power input, not of the motor, so no measure of torque
    current: float
    duty: float | None = None  # Share of the supply on the motor, as the servo tells it [1]


@dataclass(frozen=True, kw_only=True, slots=True)
class ServoHealth:
    """Slowly changing readings, taken about once a second."""

    voltage: float  # Supply voltage [V]
    temperature: float  # Temperature inside [degC]
    hardware_error: int  # Hardware Error Status (70), or Feetech's Status (65)
    # The motor is driven; false after a restart of the servo, whatever was set
    torque_enabled: bool
    watchdog_tripped: bool  # The servo stopped because no instruction came in time
    alerts: tuple[str, ...] = ()  # Meaning of the hardware error, in words


@dataclass(frozen=True, kw_only=True, slots=True)
class PositionGains:
    """Gains of the firmware's position loop, in its own units."""

    proportional: int  # Position P Gain (84); 1/128 of a count of duty per count of position
    integral: int = 0  # Position I Gain (82)
    derivative: int = 0  # Position D Gain (80)


@dataclass(frozen=True, kw_only=True, slots=True)
class OverloadProtection:
    """A Feetech servo's firmware gives less once it has given much for long."""

    duty: float  # Duty from which the time counts [1]
    protective_duty: float  # Greatest duty afterwards [1]
    time: float  # Longest time at such a duty [s]


@dataclass(frozen=True, kw_only=True, slots=True)
class ServoSettings:
    """Read back from a servo: all that decides its step response, for the log."""

    model: str  # Name in the table of servos
    firmware: int  # Firmware Version (6)
    identifier: int  # ID on the bus
    baud: int  # Rate of the bus [1/s]
    operating_mode: int  # Operating Mode (11)
    drive_mode: int  # Drive Mode (10)
    return_delay: float  # Pause before an answer [s]
    gains: PositionGains  # Gains of the firmware's position loop
    feedforward: tuple[int, int]  # Feedforward 1st and 2nd Gain (90, 88)
    profile_velocity: int  # Profile Velocity (112) [counts]; 0 is a step
    profile_acceleration: int  # Profile Acceleration (108) [counts]; 0 is a step
    duty_limit: float  # PWM Limit (36) [1]
    current_limit: float  # Current Limit (38) [A]
    velocity_limit: float  # Velocity Limit (44) [rad/s]
    temperature_limit: float  # Temperature Limit (31) [degC]
    voltage_limits: tuple[float, float]  # Min and Max Voltage Limit (34, 32) [V]
    shutdown: int  # Shutdown (63): which alerts stop the motor
    watchdog: float  # Bus Watchdog (98) [s]; 0 is off
    latency_timer: int | None  # Latency timer of the USB adapter [ms], where the system tells
    # Least duty with which a Feetech servo's position loop starts to move [1]
    starting_duty: float | None = None
    # Errors clockwise and the other way that a Feetech servo's position loop leaves [rad]
    dead_zone: tuple[float, float] | None = None
    overload: OverloadProtection | None = None  # Overload protection of a Feetech servo


@dataclass(kw_only=True, slots=True)
class ServoCounters:
    """Counts of questions to a servo and of their failures; they only grow."""

    reads: int = 0  # States that were asked for
    missed: int = 0  # Requested states that never came
    retries: int = 0  # Instructions that were sent again
    silent: int = 0  # Answers that did not come
    corrupted: int = 0  # Answers that came broken
    limited: int = 0  # Duties beyond the limit, which were cut
    alerts: int = 0  # Answers with the alert bit
    resets: int = 0  # Times that the servo had restarted by itself
    watchdog_trips: int = 0  # Times that its watchdog had stopped it
    reconnects: int = 0  # Times that the port was opened again
