"""Families of servos by name."""

from collections.abc import Mapping
from types import MappingProxyType

from hardware.servos.dynamixel import DYNAMIXEL
from hardware.servos.family import ServoFamily
from hardware.servos.feetech import FEETECH

FAMILIES: Mapping[str, ServoFamily] = MappingProxyType({"dynamixel": DYNAMIXEL, "feetech": FEETECH})
