"""Control tables of the two servos: what stands where, who may write it and within which range.

Source: ROBOTIS e-manual, XC330-T288-T and XL330-M288-T, control table of firmware 52 and later.
"""

from dataclasses import dataclass

MODEL_NUMBER = 0
FIRMWARE_VERSION = 6
IDENTIFIER = 7
BAUD_RATE = 8
RETURN_DELAY = 9
DRIVE_MODE = 10
OPERATING_MODE = 11
TEMPERATURE_LIMIT = 31
MAX_VOLTAGE = 32
MIN_VOLTAGE = 34
PWM_LIMIT = 36
PWM_SLOPE = 62
SHUTDOWN = 63
TORQUE_ENABLE = 64
STATUS_RETURN_LEVEL = 68
HARDWARE_ERROR = 70
BUS_WATCHDOG = 98
GOAL_PWM = 100
GOAL_POSITION = 116
REALTIME_TICK = 120
PRESENT_PWM = 124
PRESENT_CURRENT = 126
PRESENT_VELOCITY = 128
PRESENT_POSITION = 132
INPUT_VOLTAGE = 144
TEMPERATURE = 146


FIRST_RAM_ADDRESS = 64
TABLE_SIZE = 228
PWM_FULL = 885  # Register value of full duty; one step is 0.113 %
COUNTS_PER_TURN = 4096
VELOCITY_UNIT = 0.0239691227
"""One step of a velocity register [rad/s]: 0.229 revolutions per minute."""
CURRENT_UNIT = 1e-3  # One step of a current register [A]
VOLTAGE_UNIT = 0.1  # One step of a voltage register [V]
MULTI_TURN_LIMIT = 1_048_575  # Largest goal of the extended position mode [counts]
GOALS = frozenset(range(GOAL_PWM, REALTIME_TICK))  # Registers that a tripped bus watchdog locks


@dataclass(frozen=True, kw_only=True, slots=True)
class TableRegister:
    """Register of a control table, with its bounds and rights."""

    address: int
    size: int
    writable: bool = True
    initial: int = 0
    low: int = 0
    high: int = 0
    signed: bool = False

    @property
    def in_eeprom(self) -> bool:
        """Whether it survives power-off and is locked while torque is on."""
        return self.address < FIRST_RAM_ADDRESS


@dataclass(frozen=True, kw_only=True, slots=True)
class ServoModel:
    """Values that differ between the tables of the servos."""

    name: str
    number: int
    voltage_limits: tuple[int, int]  # Highest and lowest input voltage at the factory [0.1 V]
    voltage_range: tuple[int, int]
    current_limit: int
    velocity_limit: int
    pwm_slope: int
    pwm_slope_unit: float  # One step of the slope of the output voltage [V/s]
    shutdown: int
    velocity_gains: tuple[int, int]  # I and P at the factory
    position_gain: int
    alert_bits: None = None  # Bits of alerts are those of a fault event's own table


XC330_T288_T = ServoModel(
    name="xc330_t288_t",
    number=1220,
    voltage_limits=(140, 55),
    voltage_range=(55, 140),
    current_limit=910,
    velocity_limit=320,
    pwm_slope=255,
    pwm_slope_unit=3.955,
    shutdown=52,
    velocity_gains=(1200, 40),
    position_gain=900,
)
XL330_M288_T = ServoModel(
    name="xl330_m288_t",
    number=1200,
    voltage_limits=(70, 35),
    voltage_range=(31, 70),
    current_limit=1750,
    velocity_limit=445,
    pwm_slope=140,
    pwm_slope_unit=1.977,
    shutdown=53,
    velocity_gains=(1600, 180),
    position_gain=400,
)


def register_table(model: ServoModel) -> dict[int, TableRegister]:
    """Return a servo's registers by address."""
    rows = [*eeprom_rows(model), *ram_rows(model), *present_rows()]
    return {row.address: row for row in rows}


def eeprom_rows(model: ServoModel) -> list[TableRegister]:
    """Return what is kept without power."""
    low, high = model.voltage_range
    most, least = model.voltage_limits
    return [
        TableRegister(address=0, size=2, writable=False, initial=model.number),
        TableRegister(address=2, size=4, writable=False),
        TableRegister(address=6, size=1, writable=False, initial=52),
        TableRegister(address=7, size=1, initial=1, high=252),
        TableRegister(address=8, size=1, initial=1, high=6),
        TableRegister(address=9, size=1, initial=250, high=254),
        TableRegister(address=10, size=1, high=5),
        TableRegister(address=11, size=1, initial=3, high=16),
        TableRegister(address=12, size=1, initial=255, high=255),
        TableRegister(address=13, size=1, initial=2, low=2, high=22),
        TableRegister(address=20, size=4, low=-1_044_479, high=1_044_479, signed=True),
        TableRegister(address=24, size=4, initial=10, high=1023),
        TableRegister(address=31, size=1, initial=70, high=100),
        TableRegister(address=32, size=2, initial=most, low=low, high=high),
        TableRegister(address=34, size=2, initial=least, low=low, high=high),
        TableRegister(address=36, size=2, initial=PWM_FULL, high=PWM_FULL),
        TableRegister(address=38, size=2, initial=model.current_limit, high=model.current_limit),
        TableRegister(address=44, size=4, initial=model.velocity_limit, high=2047),
        TableRegister(address=48, size=4, initial=4095, high=4095),
        TableRegister(address=52, size=4, high=4095),
        TableRegister(address=60, size=1, high=3),
        TableRegister(address=62, size=1, initial=model.pwm_slope, low=1, high=255),
        TableRegister(address=63, size=1, initial=model.shutdown, high=63),
    ]


def ram_rows(model: ServoModel) -> list[TableRegister]:
    """Return what a reboot resets."""
    integral, proportional = model.velocity_gains
    gains = {76: integral, 78: proportional, 80: 0, 82: 0, 84: model.position_gain, 88: 0, 90: 0}
    return [
        TableRegister(address=64, size=1, high=1),
        TableRegister(address=65, size=1, high=1),
        TableRegister(address=68, size=1, initial=2, high=2),
        TableRegister(address=69, size=1, writable=False),
        TableRegister(address=70, size=1, writable=False),
        *(
            TableRegister(address=a, size=2, initial=value, high=16_383)
            for a, value in gains.items()
        ),
        TableRegister(address=98, size=1, high=127),
        TableRegister(address=100, size=2, low=-PWM_FULL, high=PWM_FULL, signed=True),
        TableRegister(address=102, size=2, low=-2047, high=2047, signed=True),
        TableRegister(address=104, size=4, low=-2047, high=2047, signed=True),
        TableRegister(address=108, size=4, high=32_767),
        TableRegister(address=112, size=4, high=32_767),
        TableRegister(
            address=116, size=4, low=-MULTI_TURN_LIMIT, high=MULTI_TURN_LIMIT, signed=True
        ),
    ]


def present_rows() -> list[TableRegister]:
    """Return what the servo measures; nobody writes it."""
    sizes = {120: 2, 122: 1, 123: 1, 124: 2, 126: 2, 128: 4, 132: 4, 136: 4, 140: 4, 144: 2}
    return [
        *(
            TableRegister(address=a, size=size, writable=False, signed=124 <= a <= 140)
            for a, size in sizes.items()
        ),
        TableRegister(address=146, size=1, writable=False),
        TableRegister(address=147, size=1, writable=False, initial=1),
    ]
