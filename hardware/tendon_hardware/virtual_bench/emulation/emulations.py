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


@dataclass(frozen=True, kw_only=True)
class Family:
    """Servos of one family, the classes of their memory, loop and side of the bus, and its parser.

    `set_up` gives a servo's memory an ID and 1 Mbit/s, as an operator does once.
    """

    models: tuple[AnyModel, ...]
    registers: Callable[[Any], AnyRegisters]
    firmware: Callable[[Any, Motor, Encoder], AnyFirmware]
    emulator: Callable[[Any, Any, Motor, ServoConstants, random.Random], AnyEmulator]
    parser: type[FrameParser]
    set_up: Callable[[Any, int], None]


def set_up_dynamixel(registers: Registers, identifier: int) -> None:
    """Store what the EEPROM of a Dynamixel keeps."""
    registers.store(dynamixel.IDENTIFIER, identifier)
    registers.store(dynamixel.BAUD_RATE, 3)


def set_up_feetech(registers: FeetechRegisters, identifier: int) -> None:
    """Store what a Feetech servo keeps."""
    registers.keep(feetech.IDENTIFIER, identifier)
    registers.keep(feetech.BAUD_RATE, 0)


EMULATED: dict[str, Family] = {
    "dynamixel": Family(
        models=(XC330_T288_T, XL330_M288_T), registers=Registers, firmware=Firmware,
        emulator=ServoEmulator, parser=FrameParser, set_up=set_up_dynamixel,
    ),
    "feetech": Family(
        models=(STS3215, STS3250), registers=FeetechRegisters, firmware=FeetechFirmware,
        emulator=FeetechEmulator, parser=FeetechParser, set_up=set_up_feetech,
    ),
}  # fmt: skip
"""Families that a virtual bench can have, by the keys of the real ones."""
SERVO_MODELS: dict[str, AnyModel] = {
    model.name: model for family in EMULATED.values() for model in family.models
}
"""Servos that a virtual bench can have, by name."""


def family_of(model: AnyModel) -> Family:
    """Return the family of a servo."""
    return next(family for family in EMULATED.values() if model in family.models)
