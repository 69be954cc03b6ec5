"""The measured channels: column, unit, and the range outside which the unit must be wrong.

The ranges are no safety limits. Each range is wide enough for every bench that a servo of this
class can drive. Each is also so narrow that the usual slip leaves it: milli- for plain units,
degrees for radians.
"""

from dataclasses import dataclass
from math import pi


@dataclass(frozen=True)
class Channel:
    """One channel of a recording as it stands in a file."""

    field: str  # Attribute of a recording that holds it
    column: str  # Column name in a file
    unit: str  # SI unit in words
    lower: float  # Least credible value [unit]
    upper: float  # Greatest credible value [unit]
    slip: str  # Most likely unit of a value outside the range


# ten turns: 0.79 m of tendon on the nominal 12.5 mm spool, while fingers need 2 turns; 60 degrees
# taken for radians already leave it
TURNS = 20.0 * pi

ANGLES = 'degrees (unit = "deg" in a mapping) or encoder counts (scale = 0.00153398 of 4096 a turn)'

CHANNELS = (
    Channel("command", "theta_d", "radians", -TURNS, TURNS, ANGLES),
    Channel("motor_position", "theta", "radians", -TURNS, TURNS, ANGLES),
    # a released spool of the nominal finger reaches 170 rad/s; the fastest servo of the class,
    # XL330-M077, turns at 48 rad/s without load (ROBOTIS e-manual)
    Channel("motor_velocity", "theta_dot", "radians per second", -1000.0, 1000.0,
        'degrees per second (unit = "deg/s" in a mapping) or register counts (scale = ...)'),
    # the servo gives at most 21 N, so 21,000 mN or 2,140 g of tension leave the range
    Channel("force", "force", "newtons", -1000.0, 1000.0,
        "millinewtons or grams (unit in a mapping), or a motor's milliamperes"),
    Channel("joint_position", "joint_angle", "radians", -TURNS, TURNS, ANGLES),
    # a joint that any of these servos turns holds a few newton metres
    Channel("joint_load", "joint_load", "newton metres", -100.0, 100.0,
        "millinewton metres (unit in a mapping) or register counts"),
    # a finger is 55 mm long: its tip in millimetres leaves the range
    Channel("tip", "tip", "metres", -1.0, 1.0, 'millimetres (unit = "mm" in a mapping)'),
    # a DYNAMIXEL-P PH54-200 stalls below 20 A and is far stronger than these benches need
    Channel("current", "current", "amperes", -30.0, 30.0,
        'milliamperes (unit = "mA" in a mapping) or register counts (scale = ...)'),
    # the highest supply of the class is 24 V (DYNAMIXEL-P)
    Channel("voltage", "voltage", "volts", 0.0, 40.0,
        'millivolts (unit = "mV" in a mapping) or tenths of a volt (scale = 0.1)'),
    # from a cold room to far above the 70 degC at which these servos shut down
    Channel("temperature", "temperature", "degrees Celsius", -40.0, 200.0,
        "kelvins (offset = -273.15 in a mapping) or tenths of a degree (scale = 0.1)"),
)  # fmt: skip
