"""Servos of ROBOTIS's X-330 series."""

from types import MappingProxyType

from tendon_hardware.servos.base import VOLTAGE
from tendon_hardware.servos.dynamixel.dynamixel_packets import DynamixelPackets
from tendon_hardware.servos.dynamixel.dynamixel_registers import TABLE, read_settings, targets
from tendon_hardware.servos.family import ServoFamily

RATES = {1_000_000: 3, 57_600: 1, 2_000_000: 4, 3_000_000: 5, 4_000_000: 6, 115_200: 2}
ALERTS = {
    0: VOLTAGE,
    2: "overheating",
    3: "encoder fault",
    4: "electrical shock or too little power",
    5: "overload",
}
"""Bits of Hardware Error Status (70)."""

DYNAMIXEL = ServoFamily(
    packets=DynamixelPackets,
    table=TABLE,
    rates=MappingProxyType(RATES),
    rates_sought=tuple(RATES),
    targets=targets,
    read_settings=read_settings,
    velocity_scale=lambda _: 1.0,
    motor_off=None,
    forgets=None,
    alerts=MappingProxyType(ALERTS),
    remedy="restart it: tendon-newton doctor --port ... --reboot",
)
