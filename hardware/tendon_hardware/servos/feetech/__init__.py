"""Feetech's STS and SMS servos, such as the STS3215."""

from types import MappingProxyType

from tendon_hardware.servos.family import ServoFamily
from tendon_hardware.servos.feetech.feetech_packets import FeetechPackets, motor_off
from tendon_hardware.servos.feetech.feetech_registers import (
    FORGETS,
    TABLE,
    read_settings,
    targets,
    velocity_scale,
)

RATES = {1_000_000: 0, 500_000: 1, 115_200: 4}
"""Rates whose codes all sources agree on, and that the SDK's port has."""

FEETECH = ServoFamily(
    packets=FeetechPackets,
    table=TABLE,
    rates=MappingProxyType(RATES),
    rates_sought=(*RATES, 57_600, 38_400),
    targets=targets,
    read_settings=read_settings,
    velocity_scale=velocity_scale,
    motor_off=motor_off,
    forgets=FORGETS,
    remedy="switch its supply off and on",
)
