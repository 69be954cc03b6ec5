"""The measured channels: column, unit, and the range outside which the unit must be wrong.

The ranges are no safety limits. Each range is wide enough for every bench that a servo of this
class can drive. Each is also so narrow that the usual slip leaves it: milli- for plain units,
degrees for radians.
"""

from dataclasses import dataclass
from math import pi


@dataclass(frozen=True, kw_only=True)
class Channel:
    """One channel of a recording as it stands in a file."""

    field: str
    """Attribute of a recording that holds it."""
    column: str
    """Column name in a file."""
    unit: str
    """SI unit in words."""
    lower: float
    """Least credible value [unit]."""
    upper: float
    """Greatest credible value [unit]."""
    slip: str
    """Most likely unit of a value outside the range."""


# ten turns: 0.79 m of tendon on the nominal 12.5 mm spool, while fingers need 2 turns; 60 degrees
# taken for radians already leave it
TURNS = 20.0 * pi

CHANNELS = (
    Channel(
        field="command",
        column="theta_d",
        unit="radians",
        lower=-TURNS,
        upper=TURNS,
        slip="degrees or encoder counts",
    ),
    Channel(
        field="motor_position",
        column="theta",
        unit="radians",
        lower=-TURNS,
        upper=TURNS,
        slip="degrees or encoder counts",
    ),
    # a released spool of the nominal finger reaches 170 rad/s; the fastest servo of the class,
    # XL330-M077, turns at 48 rad/s without load (ROBOTIS e-manual)
    Channel(
        field="motor_velocity",
        column="theta_dot",
        unit="radians per second",
        lower=-1000.0,
        upper=1000.0,
        slip="degrees per second or register counts",
    ),
    # the servo gives at most 21 N, so 21,000 mN or 2,140 g of tension leave the range
    Channel(
        field="force",
        column="force",
        unit="newtons",
        lower=-1000.0,
        upper=1000.0,
        slip="millinewtons or grams",
    ),
    Channel(
        field="joint_position",
        column="joint_angle",
        unit="radians",
        lower=-TURNS,
        upper=TURNS,
        slip="degrees or encoder counts",
    ),
    # a joint that any of these servos turns holds a few newton metres
    Channel(
        field="joint_load",
        column="joint_load",
        unit="newton metres",
        lower=-100.0,
        upper=100.0,
        slip="millinewton metres or register counts",
    ),
    # a finger is 55 mm long: its tip in millimetres leaves the range
    Channel(field="tip", column="tip", unit="metres", lower=-1.0, upper=1.0, slip="millimetres"),
    # a DYNAMIXEL-P PH54-200 stalls below 20 A and is far stronger than these benches need
    Channel(
        field="current",
        column="current",
        unit="amperes",
        lower=-30.0,
        upper=30.0,
        slip="milliamperes or register counts",
    ),
    # the highest supply of the class is 24 V (DYNAMIXEL-P)
    Channel(
        field="voltage",
        column="voltage",
        unit="volts",
        lower=0.0,
        upper=40.0,
        slip="millivolts or tenths of a volt",
    ),
    # from a cold room to far above the 70 degC at which these servos shut down
    Channel(
        field="temperature",
        column="temperature",
        unit="degrees Celsius",
        lower=-40.0,
        upper=200.0,
        slip="kelvins or tenths of a degree",
    ),
)

TIME_STEP_RANGE = (5e-5, 0.5)
"""Credible median steps of the time column [s]. Shorter ones are above any servo bus (20 kHz),
longer ones slower than any motion of a finger. 80 Hz written in milliseconds is a step of 12.5."""
