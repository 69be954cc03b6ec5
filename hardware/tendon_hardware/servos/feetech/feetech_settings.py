"""Registers of a configuration, and the settings that are read back for the log."""

from math import ceil

from tendon_hardware.serial_ports import latency_timer
from tendon_hardware.servos.base import OverloadProtection, PositionGains, ServoSettings, ServoSpec
from tendon_hardware.servos.family import ControlTable, Reader, Targets
from tendon_hardware.servos.feetech import feetech_registers as r
from tendon_hardware.servos.serial_bus.packets import Register

# EEPROM; while Lock (55) is 1, what is written here is lost with the power, and wears nothing out
FIRMWARE_MAJOR = Register(name="Firmware Major Version", address=0, size=1)
FIRMWARE_MINOR = Register(name="Firmware Minor Version", address=1, size=1)
MODEL_NUMBER = Register(name="Model Number", address=3, size=2)
IDENTIFIER = Register(name="ID", address=5, size=1)
BAUD_RATE = Register(name="Baud Rate", address=6, size=1)
RETURN_DELAY = Register(name="Return Delay Time", address=7, size=1)  # 2 us
RESPONSE_LEVEL = Register(name="Response Status Level", address=8, size=1)
TEMPERATURE_LIMIT = Register(name="Max Temperature Limit", address=13, size=1)  # 1 degC
VOLTAGE_LIMIT_MAX = Register(name="Max Voltage Limit", address=14, size=1)
VOLTAGE_LIMIT_MIN = Register(name="Min Voltage Limit", address=15, size=1)
PHASE = Register(name="Phase", address=18, size=1)
UNLOADING = Register(name="Unloading Condition", address=19, size=1)  # bits of Status (65)
P_GAIN = Register(name="P Coefficient", address=21, size=1)
D_GAIN = Register(name="D Coefficient", address=22, size=1)
I_GAIN = Register(name="I Coefficient", address=23, size=1)
STARTING_FORCE = Register(name="Minimum Startup Force", address=24, size=1)  # 0.1 % of duty
DEAD_ZONE_CW = Register(name="CW Dead Zone", address=26, size=1)  # counts of position
DEAD_ZONE_CCW = Register(name="CCW Dead Zone", address=27, size=1)
PROTECTION_CURRENT = Register(name="Protection Current", address=28, size=2)
OPERATING_MODE = Register(name="Operating Mode", address=33, size=1)
PROTECTIVE_TORQUE = Register(name="Protective Torque", address=34, size=1)  # 1 % of duty
PROTECTION_TIME = Register(name="Protection Time", address=35, size=1)  # 10 ms
OVERLOAD_TORQUE = Register(name="Overload Torque", address=36, size=1)  # 1 % of duty

# RAM
TORQUE_ENABLE = Register(name="Torque Enable", address=40, size=1)
ACCELERATION = Register(name="Acceleration", address=41, size=1)  # 100 counts/s^2; 0 is none
GOAL_PWM = Register(name="Goal Time, in PWM mode Goal PWM", address=44, size=2, sign_bit=10)
GOAL_VELOCITY = Register(name="Goal Velocity", address=46, size=2, sign_bit=15)
TORQUE_LIMIT = Register(name="Torque Limit", address=48, size=2)  # 0.1 % of duty
LOCK = Register(name="Lock", address=55, size=1)
PRESENT_POSITION = Register(name="Present Position", address=56, size=2, sign_bit=15)
PRESENT_VELOCITY = Register(name="Present Velocity", address=58, size=2, sign_bit=15)
PRESENT_VOLTAGE = Register(name="Present Voltage", address=62, size=1)
PRESENT_TEMPERATURE = Register(name="Present Temperature", address=63, size=1)  # 1 degC
STATUS = Register(name="Status", address=65, size=1)
PRESENT_CURRENT = Register(name="Present Current", address=69, size=2, sign_bit=15)
MAXIMUM_VELOCITY = Register(name="Maximum Velocity Limit", address=84, size=1)

RETURN_DELAY_UNIT = 2e-6
"""Unit of the return delay [s]."""
PROTECTION_TIME_UNIT = 0.01
"""Unit of the time of an overload [s]."""
MAXIMUM_VELOCITY_UNIT = 50
"""Unit of the greatest speed [counts/s]."""
FINE_SPEED = 4
"""Bit of Phase (18) with which a count of speed is one count of position a second; else 50."""
PWM_MODE = 2

TABLE = ControlTable(
    model=MODEL_NUMBER,
    identifier=IDENTIFIER,
    baud_rate=BAUD_RATE,
    answers=RESPONSE_LEVEL,
    answers_all=1,
    torque=TORQUE_ENABLE,
    goal_duty=GOAL_PWM,
    position=PRESENT_POSITION,
    velocity=PRESENT_VELOCITY,
    current=PRESENT_CURRENT,
    voltage=PRESENT_VOLTAGE,
    temperature=PRESENT_TEMPERATURE,
    alerts=STATUS,
    mark=ACCELERATION,  # profiles belong to the position mode; 0 after a restart
    marked=254,
    watchdog=None,
    lock=LOCK,
    counts_turns=False,
    end=87,
)
"""State: from 56 to 70, so that one read of fifteen bytes is one instant."""


COARSE = 50.0
"""Counts of position a second in a count of speed, where Phase (18) does not ask for one [1]."""


UNLOADING_ALL = 0x2C
"""Heat, too much current and overload end the pull, as at the factory."""
FORGETS = OverloadProtection(duty=0.02, protective_duty=0.0, time=0.5)
"""A motor that has been given more than this share of its duty for so long without a rest is given
none, by its own firmware. An STS3215 pulls 5 N at this share at most, an STS3250 8 N. The driver's
rests are the servo's sign of life: nothing else in this memory table ends a forgotten pull.

Source: Feetech, memory table of the SMS and STS servos: the time counts while the output stays
above Overload Torque, and then falls to Protective Torque. Assumed, and not tried on a servo: that
this holds in the mode PWM, and that a rest of some milliseconds begins the time anew.
"""


def targets(spec: ServoSpec, duty_limit: float) -> Targets:
    """Return each register that must be set before the motor runs, with its counts.

    The lock comes first. Behind it the mode lasts as long as the supply: an arm that somebody else
    uses tomorrow is in its own mode again.
    """
    return (
        (r.LOCK, 1),
        (r.RETURN_DELAY, 0),  # the factory's 0.5 ms wastes half of a read
        (r.OPERATING_MODE, r.PWM_MODE),
        (r.TORQUE_LIMIT, ceil(duty_limit * spec.duty_counts)),
        (r.UNLOADING, UNLOADING_ALL),
        (r.PROTECTIVE_TORQUE, round(100.0 * FORGETS.protective_duty)),
        (r.PROTECTION_TIME, round(FORGETS.time / r.PROTECTION_TIME_UNIT)),
        (r.OVERLOAD_TORQUE, round(100.0 * FORGETS.duty)),
        (r.ACCELERATION, r.TABLE.marked),
    )


def velocity_scale(bus: Reader) -> float:
    """Return the data sheet's counts of speed in one of this servo's [1], by its Phase."""
    (phase,) = bus.read(r.PHASE)
    return 1.0 if phase & r.FINE_SPEED else COARSE


def read_settings(bus: Reader, spec: ServoSpec, port: str | None) -> ServoSettings:
    """Read back all that decides a step response, in four transactions."""
    major, minor, delay = bus.read(r.FIRMWARE_MAJOR, r.FIRMWARE_MINOR, r.RETURN_DELAY)
    temperature, highest, lowest, phase, unloading = bus.read(
        r.TEMPERATURE_LIMIT, r.VOLTAGE_LIMIT_MAX, r.VOLTAGE_LIMIT_MIN, r.PHASE, r.UNLOADING
    )
    p, d, i, starting, clockwise, other, current, mode, held, time, overload = bus.read(
        r.P_GAIN,
        r.D_GAIN,
        r.I_GAIN,
        r.STARTING_FORCE,
        r.DEAD_ZONE_CW,
        r.DEAD_ZONE_CCW,
        r.PROTECTION_CURRENT,
        r.OPERATING_MODE,
        r.PROTECTIVE_TORQUE,
        r.PROTECTION_TIME,
        r.OVERLOAD_TORQUE,
    )
    acceleration, velocity, limit, fastest = bus.read(
        r.ACCELERATION, r.GOAL_VELOCITY, r.TORQUE_LIMIT, r.MAXIMUM_VELOCITY
    )
    return ServoSettings(
        model=spec.name,
        firmware=100 * major + minor,
        identifier=bus.identifier,
        baud=bus.baud,
        operating_mode=mode,
        drive_mode=phase,
        return_delay=delay * r.RETURN_DELAY_UNIT,
        gains=PositionGains(proportional=p, integral=i, derivative=d),
        feedforward=(0, 0),
        profile_velocity=velocity,
        profile_acceleration=acceleration,
        duty_limit=limit / spec.duty_counts,
        current_limit=current * spec.current_unit,
        velocity_limit=fastest * r.MAXIMUM_VELOCITY_UNIT * spec.position_unit,
        temperature_limit=float(temperature),
        voltage_limits=(lowest * spec.voltage_unit, highest * spec.voltage_unit),
        shutdown=unloading,
        watchdog=0.0,
        latency_timer=None if port is None else latency_timer(port),
        starting_duty=starting / spec.duty_counts,
        dead_zone=(clockwise * spec.position_unit, other * spec.position_unit),
        overload=OverloadProtection(
            duty=overload / 100.0, protective_duty=held / 100.0, time=time * r.PROTECTION_TIME_UNIT
        ),
    )
