"""Registers of Feetech's STS and SMS servos, those of a configuration, and what is read back.

Source: Feetech, memory table of the SMS and STS servos, which all share; checked against the
tables of LeRobot and of Waveshare's ST3215. Numbers with a direction have it in a bit of its own.
"""

from math import ceil

from tendon_hardware.serial_ports import latency_timer
from tendon_hardware.servos.base import OverloadProtection, PositionGains, ServoSettings, ServoSpec
from tendon_hardware.servos.family import ControlTable, Reader, Targets, read_each
from tendon_hardware.servos.serial_bus.packets import Register

# EEPROM; while Lock (55) is 1, what is written here is lost with the power, and wears nothing out
FIRMWARE_MAJOR = Register(name="Firmware Major Version", address=0, size=1)
FIRMWARE_MINOR = Register(name="Firmware Minor Version", address=1, size=1)
MODEL_NUMBER = Register(name="Model Number", address=3, size=2)
RETURN_DELAY = Register(name="Return Delay Time", address=7, size=1)  # 2 us
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
GOAL_VELOCITY = Register(name="Goal Velocity", address=46, size=2, sign_bit=15)
TORQUE_LIMIT = Register(name="Torque Limit", address=48, size=2)  # 0.1 % of duty
LOCK = Register(name="Lock", address=55, size=1)
MAXIMUM_VELOCITY = Register(name="Maximum Velocity Limit", address=84, size=1)

RETURN_DELAY_UNIT = 2e-6  # Unit of the return delay [s]
PROTECTION_TIME_UNIT = 0.01  # Unit of the time of an overload [s]
MAXIMUM_VELOCITY_UNIT = 50  # Unit of the greatest speed [counts/s]
FINE_SPEED = 4
"""Bit of Phase (18) with which a count of speed is one count of position a second; else 50."""
PWM_MODE = 2

TABLE = ControlTable(
    model=MODEL_NUMBER,
    identifier=Register(name="ID", address=5, size=1),
    baud_rate=Register(name="Baud Rate", address=6, size=1),
    answers=Register(name="Response Status Level", address=8, size=1),
    answers_all=1,
    torque=TORQUE_ENABLE,
    goal_duty=Register(name="Goal Time, in PWM mode Goal PWM", address=44, size=2, sign_bit=10),
    position=Register(name="Present Position", address=56, size=2, sign_bit=15),
    velocity=Register(name="Present Velocity", address=58, size=2, sign_bit=15),
    current=Register(name="Present Current", address=69, size=2, sign_bit=15),
    # Duty of the motor, whatever its name says
    duty=Register(name="Present Load", address=60, size=2, sign_bit=10),
    voltage=Register(name="Present Voltage", address=62, size=1),
    temperature=Register(name="Present Temperature", address=63, size=1),  # 1 degC
    alerts=Register(name="Status", address=65, size=1),
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


UNLOADING_ALL = 0x2C  # Heat, too much current and overload end the pull, as at the factory
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
        (LOCK, 1),
        (RETURN_DELAY, 0),  # the factory's 0.5 ms wastes half of a read
        (OPERATING_MODE, PWM_MODE),
        (TORQUE_LIMIT, ceil(duty_limit * spec.duty_counts)),
        (UNLOADING, UNLOADING_ALL),
        (PROTECTIVE_TORQUE, round(100.0 * FORGETS.protective_duty)),
        (PROTECTION_TIME, round(FORGETS.time / PROTECTION_TIME_UNIT)),
        (OVERLOAD_TORQUE, round(100.0 * FORGETS.duty)),
        (ACCELERATION, TABLE.marked),
    )


def velocity_scale(bus: Reader) -> float:
    """Return the data sheet's counts of speed in one of this servo's [1], by its Phase."""
    (phase,) = bus.read(PHASE)
    return 1.0 if phase & FINE_SPEED else COARSE


def read_settings(bus: Reader, spec: ServoSpec, port: str | None) -> ServoSettings:
    """Read back all that decides a step response, in four transactions."""
    of = read_each(bus, FIRMWARE_MAJOR, FIRMWARE_MINOR, RETURN_DELAY)
    of |= read_each(bus, TEMPERATURE_LIMIT, VOLTAGE_LIMIT_MAX, VOLTAGE_LIMIT_MIN, PHASE, UNLOADING)
    of |= read_each(
        bus, P_GAIN, D_GAIN, I_GAIN, STARTING_FORCE, DEAD_ZONE_CW, DEAD_ZONE_CCW,
        PROTECTION_CURRENT, OPERATING_MODE, PROTECTIVE_TORQUE, PROTECTION_TIME, OVERLOAD_TORQUE,
    )  # fmt: skip
    of |= read_each(bus, ACCELERATION, GOAL_VELOCITY, TORQUE_LIMIT, MAXIMUM_VELOCITY)
    return ServoSettings(
        model=spec.name,
        firmware=100 * of[FIRMWARE_MAJOR] + of[FIRMWARE_MINOR],
        identifier=bus.identifier,
        baud=bus.baud,
        operating_mode=of[OPERATING_MODE],
        drive_mode=of[PHASE],
        return_delay=of[RETURN_DELAY] * RETURN_DELAY_UNIT,
        gains=PositionGains(proportional=of[P_GAIN], integral=of[I_GAIN], derivative=of[D_GAIN]),
        feedforward=(0, 0),
        profile_velocity=of[GOAL_VELOCITY],
        profile_acceleration=of[ACCELERATION],
        duty_limit=of[TORQUE_LIMIT] / spec.duty_counts,
        current_limit=of[PROTECTION_CURRENT] * spec.current_unit,
        velocity_limit=of[MAXIMUM_VELOCITY] * MAXIMUM_VELOCITY_UNIT * spec.position_unit,
        temperature_limit=float(of[TEMPERATURE_LIMIT]),
        voltage_limits=(
            of[VOLTAGE_LIMIT_MIN] * spec.voltage_unit,
            of[VOLTAGE_LIMIT_MAX] * spec.voltage_unit,
        ),
        shutdown=of[UNLOADING],
        watchdog=0.0,
        latency_timer=None if port is None else latency_timer(port),
        starting_duty=of[STARTING_FORCE] / spec.duty_counts,
        dead_zone=(of[DEAD_ZONE_CW] * spec.position_unit, of[DEAD_ZONE_CCW] * spec.position_unit),
        overload=OverloadProtection(
            duty=of[OVERLOAD_TORQUE] / 100.0,
            protective_duty=of[PROTECTIVE_TORQUE] / 100.0,
            time=of[PROTECTION_TIME] * PROTECTION_TIME_UNIT,
        ),
    )
