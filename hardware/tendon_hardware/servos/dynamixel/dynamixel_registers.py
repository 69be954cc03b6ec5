"""Registers of the X-330 servos, those of a configuration, and what is read back for the log.

Source: ROBOTIS e-manual, control tables of XC330-T288-T and XL330-M288-T, which agree in all that
stands here. Indirect addresses are left out: the tables of the firmwares differ on their base.
"""

from tendon_hardware.serial_ports import latency_timer
from tendon_hardware.servos.base import PositionGains, ServoSettings, ServoSpec
from tendon_hardware.servos.family import WATCHDOG_PERIOD, ControlTable, Reader, Targets, read_each
from tendon_hardware.servos.serial_bus.packets import Register

# EEPROM: writable without torque only
FIRMWARE = Register(name="Firmware Version", address=6, size=1)
RETURN_DELAY = Register(name="Return Delay Time", address=9, size=1)  # 2 us
DRIVE_MODE = Register(name="Drive Mode", address=10, size=1)
OPERATING_MODE = Register(name="Operating Mode", address=11, size=1)
TEMPERATURE_LIMIT = Register(name="Temperature Limit", address=31, size=1)  # 1 degC
VOLTAGE_LIMIT_MAX = Register(name="Max Voltage Limit", address=32, size=2)
VOLTAGE_LIMIT_MIN = Register(name="Min Voltage Limit", address=34, size=2)
PWM_LIMIT = Register(name="PWM Limit", address=36, size=2)
CURRENT_LIMIT = Register(name="Current Limit", address=38, size=2)
VELOCITY_LIMIT = Register(name="Velocity Limit", address=44, size=4)
SHUTDOWN = Register(name="Shutdown", address=63, size=1)

# RAM: lost when the servo restarts
LED = Register(name="LED", address=65, size=1)
POSITION_D_GAIN = Register(name="Position D Gain", address=80, size=2)
POSITION_I_GAIN = Register(name="Position I Gain", address=82, size=2)
POSITION_P_GAIN = Register(name="Position P Gain", address=84, size=2)
FEEDFORWARD_2ND = Register(name="Feedforward 2nd Gain", address=88, size=2)
FEEDFORWARD_1ST = Register(name="Feedforward 1st Gain", address=90, size=2)
BUS_WATCHDOG = Register(name="Bus Watchdog", address=98, size=1, signed=True)  # 20 ms; -1 tripped
PROFILE_ACCELERATION = Register(name="Profile Acceleration", address=108, size=4)
PROFILE_VELOCITY = Register(name="Profile Velocity", address=112, size=4)

RETURN_DELAY_UNIT = 2e-6  # Unit of the return delay [s]

PWM_MODE = 16

TABLE = ControlTable(
    model=Register(name="Model Number", address=0, size=2),
    identifier=Register(name="ID", address=7, size=1),
    baud_rate=Register(name="Baud Rate", address=8, size=1),
    answers=Register(name="Status Return Level", address=68, size=1),
    answers_all=2,
    torque=Register(name="Torque Enable", address=64, size=1),
    goal_duty=Register(name="Goal PWM", address=100, size=2, signed=True),
    position=Register(name="Present Position", address=132, size=4, signed=True),
    velocity=Register(name="Present Velocity", address=128, size=4, signed=True),
    current=Register(name="Present Current", address=126, size=2, signed=True),
    duty=Register(name="Present PWM", address=124, size=2, signed=True),
    voltage=Register(name="Present Input Voltage", address=144, size=2),
    temperature=Register(name="Present Temperature", address=146, size=1),  # 1 degC
    # what has happened; Shutdown (63) only says which of it stops the motor
    alerts=Register(name="Hardware Error Status", address=70, size=1),
    mark=LED,  # lit while a servo is set up
    marked=1,
    watchdog=BUS_WATCHDOG,
    lock=None,
    counts_turns=True,
    end=228,
)
"""State: neighbours from 124 to 135, so that one read of twelve bytes is one instant."""


def targets(spec: ServoSpec, duty_limit: float) -> Targets:
    """Return each register that must be set before the motor runs, with its counts.

    The position loop runs on the host, which sends duties. In a position mode the watchdog only
    freezes the goal: the motor of a program that is gone would pull on for ever. The driver alone
    keeps to the greatest duty: PWM Limit is in the EEPROM, which wears out.
    """
    del duty_limit
    return (
        (RETURN_DELAY, 0),  # the factory's 0.5 ms wastes half of a read
        (DRIVE_MODE, 0),  # positive winds in; profiles by velocity
        (OPERATING_MODE, PWM_MODE),
        (PWM_LIMIT, spec.duty_counts),
        (CURRENT_LIMIT, round(spec.current_limit / spec.current_unit)),
        (TEMPERATURE_LIMIT, round(spec.temperature_limit)),
        (POSITION_P_GAIN, spec.position_gain),
        (POSITION_I_GAIN, 0),
        (POSITION_D_GAIN, 0),
        (FEEDFORWARD_1ST, 0),
        (FEEDFORWARD_2ND, 0),
        (PROFILE_ACCELERATION, 0),  # a goal is a step
        (PROFILE_VELOCITY, 0),
        (LED, TABLE.marked),
    )


def read_settings(bus: Reader, spec: ServoSpec, port: str | None) -> ServoSettings:
    """Read back all that decides a step response, in two transactions."""
    of = read_each(
        bus, FIRMWARE, RETURN_DELAY, DRIVE_MODE, OPERATING_MODE, TEMPERATURE_LIMIT,
        VOLTAGE_LIMIT_MAX, VOLTAGE_LIMIT_MIN, PWM_LIMIT, CURRENT_LIMIT, VELOCITY_LIMIT, SHUTDOWN,
    )  # fmt: skip
    of |= read_each(
        bus, POSITION_D_GAIN, POSITION_I_GAIN, POSITION_P_GAIN, FEEDFORWARD_2ND, FEEDFORWARD_1ST,
        BUS_WATCHDOG, PROFILE_ACCELERATION, PROFILE_VELOCITY,
    )  # fmt: skip
    return ServoSettings(
        model=spec.name,
        firmware=of[FIRMWARE],
        identifier=bus.identifier,
        baud=bus.baud,
        operating_mode=of[OPERATING_MODE],
        drive_mode=of[DRIVE_MODE],
        return_delay=of[RETURN_DELAY] * RETURN_DELAY_UNIT,
        gains=PositionGains(
            proportional=of[POSITION_P_GAIN],
            integral=of[POSITION_I_GAIN],
            derivative=of[POSITION_D_GAIN],
        ),
        feedforward=(of[FEEDFORWARD_1ST], of[FEEDFORWARD_2ND]),
        profile_velocity=of[PROFILE_VELOCITY],
        profile_acceleration=of[PROFILE_ACCELERATION],
        duty_limit=of[PWM_LIMIT] / spec.duty_counts,
        current_limit=of[CURRENT_LIMIT] * spec.current_unit,
        velocity_limit=of[VELOCITY_LIMIT] * spec.velocity_unit,
        temperature_limit=float(of[TEMPERATURE_LIMIT]),
        voltage_limits=(
            of[VOLTAGE_LIMIT_MIN] * spec.voltage_unit,
            of[VOLTAGE_LIMIT_MAX] * spec.voltage_unit,
        ),
        shutdown=of[SHUTDOWN],
        watchdog=max(of[BUS_WATCHDOG], 0) * WATCHDOG_PERIOD,
        latency_timer=None if port is None else latency_timer(port),
    )
