"""Registers of Feetech's STS and SMS servos: where each number stands.

Source: Feetech, memory table of the SMS and STS servos, which all share; checked against the
tables of LeRobot and of Waveshare's ST3215. Numbers with a direction have it in a bit of its own.
"""

from tendon_hardware.servos.family import ControlTable
from tendon_hardware.servos.serial_bus.register import Register

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
