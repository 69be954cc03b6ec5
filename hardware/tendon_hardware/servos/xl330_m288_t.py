"""XL330-M288-T: cored motor, plastic gears, 288.4 to 1, 5 V class; the cheaper one.

Source: ROBOTIS e-manual, dxl/x/xl330-m288.
"""

from math import pi

from tendon_hardware.servos.base import ServoSpec

SPEC = ServoSpec(
    name="xl330_m288_t",
    model_number=1200,
    position_unit=2.0 * pi / 4096,  # 0.088 degrees
    velocity_unit=0.229 * 2.0 * pi / 60.0,  # 0.229 rev/min
    current_unit=1e-3,
    duty_counts=885,  # 0.113 % each
    supply_voltage=5.0,
    supply_range=(3.7, 6.0),
    stall_torque=0.52,
    stall_current=1.47,
    no_load_speed=103.0 * 2.0 * pi / 60.0,  # 103 rev/min
    free_speed=5.0 / 0.286,  # the least torque constant of Rhoban/bam's fits
    current_limit=1.750,
    position_gain=400,
    gear_yield=0.8,  # more than the data sheet: fits of Rhoban/bam and their friction under load
)
