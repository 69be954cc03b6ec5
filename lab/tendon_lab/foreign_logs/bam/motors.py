"""Servos that Rhoban/bam measures: the law of their firmware, and numbers to start from.

A motor of this table is driven by a voltage: duty = gain * duty_per_gain * (goal - position), cut
to the greatest duty. The start values come from data sheets, between torque per current at stall
(losses included, the least that it can be) and volts per speed without load (the most).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import pi
from types import MappingProxyType

from tendon_newton.data.model_file import NamedValues


@dataclass(frozen=True, kw_only=True)
class BamMotor:
    """One servo."""

    duty_per_gain: float  # Duty per position error and unit of the firmware's gain [1/rad]
    torque_constant: float  # To start from [N m/A]
    resistance: float  # To start from [ohm]
    armature: float  # Rotor behind the gear, to start from [kg m^2]
    max_duty: float = 1.0  # Greatest duty [1]
    full_duty: float | None = None
    """Counts of full duty in the column ``load``; None where that column is something else."""
    effects: tuple[NamedValues, ...] = ()
    """What its firmware does from the factory besides that law."""
    load_is_duty: bool = False
    """Whether a column ``torque`` is its load register over 100: duty with the sign in bit 10."""
    speed_unit: float | None = None
    """One count of the speed register [rad/s], where it may have been read as unsigned."""


COUNTS_PER_RAD = 4096.0 / (2.0 * pi)  # encoder resolution (ROBOTIS e-manual)
FULL_DUTY = 885.0  # counts of the PWM and load registers at full duty (ROBOTIS e-manual)
XL330_DUTY = COUNTS_PER_RAD / (256.0 * FULL_DUTY)  # 256 by the XL330's own load register

# ROBOTIS e-manual at 5 V: stall 0.52 N m at 1.47 A, 103 rev/min without load: 0.354 to 0.464.
# Armature: order of magnitude, a rotor of 2.4e-8 kg m^2 behind the gear of 288.35:1.
XL330 = BamMotor(
    duty_per_gain=XL330_DUTY,
    torque_constant=0.41,
    resistance=3.4,
    armature=2e-3,
    full_duty=FULL_DUTY,
    speed_unit=0.229 * 2.0 * pi / 60.0,
)
# At 12 V: stall 6.0 N m at 4.1 A, 63 rev/min; stall 8.4 N m at 5.2 A, 45 rev/min. The law was seen
# on an oscilloscope by Rhoban/bam, as that of the XL-320 and the STS3215 at 7.4 V.
MX64 = BamMotor(
    duty_per_gain=0.158, torque_constant=1.6, resistance=2.9, armature=0.01, max_duty=0.9625
)
MX106 = BamMotor(
    duty_per_gain=0.158, torque_constant=2.0, resistance=2.3, armature=0.015, max_duty=0.9625
)
XL320 = BamMotor(  # at 7.4 V: stall 0.39 N m at 1.1 A, 114 rev/min
    duty_per_gain=0.0505, torque_constant=0.5, resistance=6.7, armature=1e-3
)
XC330 = BamMotor(  # M288 at 5 V: stall 0.93 N m at 1.8 A, 81 rev/min; gain / 128 by the e-manual
    duty_per_gain=2.0 * XL330_DUTY, torque_constant=0.55, resistance=2.8, armature=2e-3
)
# Feetech's loop: kp / 4 thousandths of full duty per count of error, by its own load register.
# Owners measured 0.164 and 0.166 with an oscilloscope.
FEETECH_DUTY = COUNTS_PER_RAD / 4000.0
# Feetech memory table, factory values: a dead zone of one count, a least duty of 16 thousandths.
FEETECH_FIRMWARE = (
    NamedValues(name="deadband", values={"width": 1.0 / COUNTS_PER_RAD}),
    NamedValues(name="starting_duty", values={"duty": 0.016}),
)
# At 12 V: stall 2.94 N m at 2.7 A, 45 rev/min.
STS3215 = BamMotor(
    duty_per_gain=FEETECH_DUTY,
    torque_constant=1.4,
    resistance=3.5,
    armature=0.02,
    effects=FEETECH_FIRMWARE,
    load_is_duty=True,
)
STS3250 = BamMotor(  # at 12 V: stall 4.9 N m
    duty_per_gain=FEETECH_DUTY,
    torque_constant=1.4,
    resistance=2.5,
    armature=0.02,
    effects=FEETECH_FIRMWARE,
    load_is_duty=True,
)
ST3025 = BamMotor(  # Waveshare, the same firmware; 0.88 N m/A and 4.4 A at 12 V by its data sheet
    duty_per_gain=FEETECH_DUTY,
    torque_constant=1.2,
    resistance=2.7,
    armature=0.02,
    effects=FEETECH_FIRMWARE,
    load_is_duty=True,
)

MOTORS: Mapping[str, BamMotor] = MappingProxyType(
    {
        "mx64": MX64,
        "mx106": MX106,
        "xl320": XL320,
        "xl330": XL330,
        "xc330": XC330,
        "sts3215": STS3215,
        "sts3250": STS3250,
        "st3025": ST3025,
    }
)
"""Motors by how their names begin."""


def motor_named(name: str, motors: Mapping[str, BamMotor] = MOTORS) -> BamMotor | None:
    """Return the motor whose name this begins with, such as ``xl330_m288``; None for a stranger."""
    words = name.lower().replace("-", "")
    return next((motor for key, motor in motors.items() if key in words), None)
