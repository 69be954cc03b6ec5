"""Registers of a configuration, and the settings that are read back for the log."""

from math import ceil

from tendon_hardware.serial_ports import latency_timer
from tendon_hardware.servos.base import OverloadProtection, PositionGains, ServoSettings, ServoSpec
from tendon_hardware.servos.family import Reader, Targets
from tendon_hardware.servos.feetech import feetech_registers as r

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
