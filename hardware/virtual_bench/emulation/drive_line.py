"""One servo of a bench with its tendon and the load cell in it."""

from __future__ import annotations

import random

from hardware.virtual_bench.emulation.emulations import AnyModel, family_of
from hardware.virtual_bench.emulation.firmware import TICK
from hardware.virtual_bench.physics.encoder import Encoder
from hardware.virtual_bench.physics.load_cell import LoadCellBoard
from hardware.virtual_bench.physics.motor import Motor
from hardware.virtual_bench.physics.tendon import Tendon
from hardware.virtual_bench.physics.unit import LineConstants


class DriveLine:
    """Motor, gear and firmware of a servo, the line that it winds, and what measures its tension.

    Args:
        constants: Constants of all these parts.
        noise: Words that tell its noise from other lines'.
        model: Which servo's control table it has.
        load_cell_rate: 80 or 10, the chip's own, or 20 [Hz].
    """

    def __init__(
        self, constants: LineConstants, noise: str, *, model: AnyModel, load_cell_rate: int
    ) -> None:
        self.constants = constants
        self.motor = Motor(constants.servo)
        self.tendon = Tendon(constants.tendon)
        self.encoder = Encoder(constants.servo, random.Random(f"encoder {noise}"), TICK)
        self.family = family_of(model)
        self.registers = self.family.registers(model)
        self.registers.power_up(self.encoder.count)
        self.firmware = self.family.firmware(self.registers, self.motor, self.encoder)
        self.load_cell = LoadCellBoard(
            constants.load_cell, random.Random(f"load cell {noise}"), load_cell_rate
        )
