"""XC330-T288-T: coreless motor, metal gears, 288.35 to 1, 12 V class; the servo of the finger.

Source: ROBOTIS e-manual, dxl/x/xc330-t288.
"""

from math import pi

from tendon_hardware.servos.base import ServoSpec

SPEC = ServoSpec(
    name="xc330_t288_t",
    model_number=1220,
    position_unit=2.0 * pi / 4096,  # 0.088 degrees
    velocity_unit=0.229 * 2.0 * pi / 60.0,  # 0.229 rev/min
    current_unit=1e-3,
    duty_counts=885,  # 0.113 % each
    supply_voltage=11.1,
    supply_range=(6.5, 12.0),
    stall_torque=0.92,
    stall_current=0.80,
    no_load_speed=65.0 * 2.0 * pi / 60.0,  # 65 rev/min
    free_speed=11.1 / 1.43,  # supply by torque constant: 9.0 V at 52 rev/min
    current_limit=0.910,
    position_gain=900,
)
