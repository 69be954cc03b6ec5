"""STS3215 of 12 V: cored motor, metal gears, 345 to 1; the servo of most printed arms.

Source: Feetech, data sheet of the STS3215-C018; memory table of the STS servos. The kind of 7.4 V
answers with the same model number and is weaker: 1.9 N m and 52 rev/min at its voltage.
"""

from math import pi

from tendon_hardware.servos.base import ServoSpec

SPEC = ServoSpec(
    name="sts3215",
    model_number=777,
    position_unit=2.0 * pi / 4096,  # 0.088 degrees
    velocity_unit=2.0 * pi / 4096,  # one count of position a second
    current_unit=6.5e-3,
    duty_counts=1000,  # 0.1 % each
    supply_voltage=12.0,
    supply_range=(6.0, 12.6),
    stall_torque=2.94,  # 30 kgf cm
    stall_current=2.7,
    no_load_speed=45.0 * 2.0 * pi / 60.0,  # 45 rev/min
    free_speed=12.0 / 1.25,  # torque constant of Rhoban/bam's fits: 1.28
    current_limit=511 * 6.5e-3,  # of the factory's Protection Current (28)
    position_gain=32,
    armature=0.02,  # Rhoban/bam's fits of an STS3215
    family="feetech",
)
