"""Registers of a configuration, and the settings that are read back for the log."""

from tendon_hardware.serial_ports import latency_timer
from tendon_hardware.servos.base import PositionGains, ServoSettings, ServoSpec
from tendon_hardware.servos.dynamixel import dynamixel_registers as r
from tendon_hardware.servos.family import WATCHDOG_PERIOD, Reader, Targets


def targets(spec: ServoSpec, duty_limit: float) -> Targets:
    """Return each register that must be set before the motor runs, with its counts.

    The position loop runs on the host, which sends duties. In a position mode the watchdog only
    freezes the goal: the motor of a program that is gone would pull on for ever. The driver alone
    keeps to the greatest duty: PWM Limit is in the EEPROM, which wears out.
    """
    del duty_limit
    gains = PositionGains(proportional=spec.position_gain)
    return (
        (r.RETURN_DELAY, 0),  # the factory's 0.5 ms wastes half of a read
        (r.DRIVE_MODE, 0),  # positive winds in; profiles by velocity
        (r.OPERATING_MODE, r.PWM_MODE),
        (r.PWM_LIMIT, spec.duty_counts),
        (r.CURRENT_LIMIT, round(spec.current_limit / spec.current_unit)),
        (r.TEMPERATURE_LIMIT, round(spec.temperature_limit)),
        (r.POSITION_P_GAIN, gains.proportional),
        (r.POSITION_I_GAIN, gains.integral),
        (r.POSITION_D_GAIN, gains.derivative),
        (r.FEEDFORWARD_1ST, 0),
        (r.FEEDFORWARD_2ND, 0),
        (r.PROFILE_ACCELERATION, 0),  # a goal is a step
        (r.PROFILE_VELOCITY, 0),
        (r.LED, r.TABLE.marked),
    )


def read_settings(bus: Reader, spec: ServoSpec, port: str | None) -> ServoSettings:
    """Read back all that decides a step response, in two transactions."""
    (
        firmware,
        return_delay,
        drive_mode,
        mode,
        temperature,
        voltage_max,
        voltage_min,
        duty,
        current,
        velocity,
        shutdown,
    ) = bus.read(
        r.FIRMWARE,
        r.RETURN_DELAY,
        r.DRIVE_MODE,
        r.OPERATING_MODE,
        r.TEMPERATURE_LIMIT,
        r.VOLTAGE_LIMIT_MAX,
        r.VOLTAGE_LIMIT_MIN,
        r.PWM_LIMIT,
        r.CURRENT_LIMIT,
        r.VELOCITY_LIMIT,
        r.SHUTDOWN,
    )
    d, i, p, second, first, watchdog, acceleration, profile = bus.read(
        r.POSITION_D_GAIN,
        r.POSITION_I_GAIN,
        r.POSITION_P_GAIN,
        r.FEEDFORWARD_2ND,
        r.FEEDFORWARD_1ST,
        r.BUS_WATCHDOG,
        r.PROFILE_ACCELERATION,
        r.PROFILE_VELOCITY,
    )
    return ServoSettings(
        model=spec.name,
        firmware=firmware,
        identifier=bus.identifier,
        baud=bus.baud,
        operating_mode=mode,
        drive_mode=drive_mode,
        return_delay=return_delay * r.RETURN_DELAY_UNIT,
        gains=PositionGains(proportional=p, integral=i, derivative=d),
        feedforward=(first, second),
        profile_velocity=profile,
        profile_acceleration=acceleration,
        duty_limit=duty / spec.duty_counts,
        current_limit=current * spec.current_unit,
        velocity_limit=velocity * spec.velocity_unit,
        temperature_limit=float(temperature),
        voltage_limits=(voltage_min * spec.voltage_unit, voltage_max * spec.voltage_unit),
        shutdown=shutdown,
        watchdog=max(watchdog, 0) * WATCHDOG_PERIOD,
        latency_timer=None if port is None else latency_timer(port),
    )
