"""Feetech's STS and SMS servos, such as the STS3215."""

from types import MappingProxyType

from tendon_hardware.servos.base import VOLTAGE
from tendon_hardware.servos.family import ServoFamily
from tendon_hardware.servos.feetech import feetech_registers
from tendon_hardware.servos.feetech.feetech_packets import FeetechPackets, motor_off

RATES = {1_000_000: 0, 500_000: 1, 115_200: 4}
"""Rates whose codes all sources agree on, and that the SDK's port has."""
ALERTS = {
    0: VOLTAGE,
    1: "encoder fault",
    2: "overheating",
    3: "current beyond its limit",
    5: "overload",
}
"""Bits of Status (65)."""

FEETECH = ServoFamily(
    packets=FeetechPackets,
    table=feetech_registers.TABLE,
    rates=MappingProxyType(RATES),
    rates_sought=(*RATES, 57_600, 38_400),
    targets=feetech_registers.targets,
    read_settings=feetech_registers.read_settings,
    velocity_scale=feetech_registers.velocity_scale,
    motor_off=motor_off,
    forgets=feetech_registers.FORGETS,
    alerts=MappingProxyType(ALERTS),
    remedy="switch its supply off and on",
)
