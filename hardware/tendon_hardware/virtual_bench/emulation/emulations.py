"""Memory, firmware and bus of an emulated servo, by the family of its model."""

import random
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from tendon_hardware.virtual_bench.emulation.feetech_emulator import FeetechEmulator, FeetechParser
from tendon_hardware.virtual_bench.emulation.feetech_firmware import FeetechFirmware
from tendon_hardware.virtual_bench.emulation.firmware import Firmware
from tendon_hardware.virtual_bench.emulation.servo_emulator import ServoEmulator
from tendon_hardware.virtual_bench.memory import control_table as dynamixel
from tendon_hardware.virtual_bench.memory import feetech_table as feetech
from tendon_hardware.virtual_bench.memory.control_table import (
    XC330_T288_T,
    XL330_M288_T,
    ServoModel,
)
from tendon_hardware.virtual_bench.memory.feetech_table import (
    STS3215,
    STS3250,
    FeetechModel,
    FeetechRegisters,
)
from tendon_hardware.virtual_bench.memory.protocol import FrameParser
from tendon_hardware.virtual_bench.memory.registers import Registers
from tendon_hardware.virtual_bench.physics.constants import ServoConstants
from tendon_hardware.virtual_bench.physics.encoder import Encoder
from tendon_hardware.virtual_bench.physics.motor import Motor

AnyModel = ServoModel | FeetechModel
AnyRegisters = Registers | FeetechRegisters
AnyFirmware = Firmware | FeetechFirmware
AnyEmulator = ServoEmulator | FeetechEmulator
SERVO_MODELS: dict[str, AnyModel] = {
    model.name: model for model in (STS3215, STS3250, XC330_T288_T, XL330_M288_T)
}
"""Servos that a virtual bench can have, by name."""


@dataclass(frozen=True, kw_only=True)
class Family:
    """Classes of a servo's memory, loop and side of the bus, and what parses that bus."""

    registers: Callable[[Any], AnyRegisters]
    firmware: Callable[[Any, Motor, Encoder], AnyFirmware]
    emulator: Callable[[Any, Any, Motor, ServoConstants, random.Random], AnyEmulator]
    parser: type[FrameParser]


DYNAMIXEL = Family(
    registers=Registers, firmware=Firmware, emulator=ServoEmulator, parser=FrameParser
)
FEETECH = Family(
    registers=FeetechRegisters,
    firmware=FeetechFirmware,
    emulator=FeetechEmulator,
    parser=FeetechParser,
)


def family_of(model: AnyModel) -> Family:
    """Return the family of a servo."""
    return FEETECH if isinstance(model, FeetechModel) else DYNAMIXEL


def set_up(registers: AnyRegisters, identifier: int) -> None:
    """Give a servo its ID and 1 Mbit/s, as an operator does once."""
    if isinstance(registers, FeetechRegisters):
        registers.keep(feetech.IDENTIFIER, identifier)
        registers.keep(feetech.BAUD_RATE, 0)
    else:
        registers.store(dynamixel.IDENTIFIER, identifier)
        registers.store(dynamixel.BAUD_RATE, 3)
