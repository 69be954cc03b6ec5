"""Families of servos by name."""

from tendon_hardware.servos.dynamixel import DYNAMIXEL
from tendon_hardware.servos.family import ServoFamily
from tendon_hardware.servos.feetech import FEETECH

FAMILIES: dict[str, ServoFamily] = {"dynamixel": DYNAMIXEL, "feetech": FEETECH}
