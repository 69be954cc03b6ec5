"""Families of servos by name."""

from collections.abc import Mapping
from types import MappingProxyType

from tendon_hardware.servos.dynamixel import DYNAMIXEL
from tendon_hardware.servos.family import ServoFamily
from tendon_hardware.servos.feetech import FEETECH

FAMILIES: Mapping[str, ServoFamily] = MappingProxyType({"dynamixel": DYNAMIXEL, "feetech": FEETECH})
