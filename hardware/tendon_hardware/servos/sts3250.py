"""STS3250 of 12 V: coreless motor, metal gears and case, 345 to 1; the stronger one.

Source: Feetech, data sheet of the STS3250, edition A/0; memory table of the STS servos.
"""

from math import pi

from tendon_hardware.servos.base import ServoSpec

SPEC = ServoSpec(
    name="sts3250",
    model_number=2825,
    position_unit=2.0 * pi / 4096,  # 0.088 degrees
    velocity_unit=2.0 * pi / 4096,  # one count of position a second
    current_unit=6.5e-3,
    duty_counts=1000,  # 0.1 % each
    supply_voltage=12.0,
    supply_range=(6.0, 12.6),
    stall_torque=4.9,  # 50 kgf cm
    stall_current=7.5,  # reckoned: the STS3215's, times the ratios of torque and of speed
    no_load_speed=2.0 * pi / (6.0 * 0.133),  # 0.133 s for 60 degrees
    free_speed=12.0 / 1.25,  # the gear is the STS3215's
    current_limit=511 * 6.5e-3,  # of the factory's Protection Current (28)
    position_gain=32,
    armature=0.02,  # Rhoban/bam's fits of an STS3215
    family="feetech",
)
