"""The bench as one system: servo, tendon, mechanism, what blocks it, and the load cell."""

from __future__ import annotations

import random
from dataclasses import dataclass

from hardware.virtual_bench.constants import TIME_STEP, SliderConstants
from hardware.virtual_bench.control_table import XC330_T288_T, ServoModel
from hardware.virtual_bench.encoder import Encoder
from hardware.virtual_bench.firmware import TICK, Firmware
from hardware.virtual_bench.load_cell import LoadCellBoard
from hardware.virtual_bench.mechanisms import Finger, Mechanism, Slider
from hardware.virtual_bench.motor import Motor
from hardware.virtual_bench.obstacle import Obstacle
from hardware.virtual_bench.registers import Registers
from hardware.virtual_bench.tendon import Tendon
from hardware.virtual_bench.unit import Unit

PROTECTION_TICKS = 10
"""Ticks between two looks at voltage and warmth."""
REST_TICKS = 1500
"""Ticks in which the mechanism comes to rest before time starts."""


@dataclass(frozen=True, kw_only=True, slots=True)
class PlantState:
    """What is true at an instant; no sensor says it so well."""

    time: float
    """[s] since the plant started."""
    angle: float
    """Of the spool from where the tendon was homed [rad]."""
    rate: float
    """[rad/s]"""
    tension: float
    """At the load cell [N]."""
    excursion: float
    """Line that the mechanism has given [m]."""
    current: float
    """At the power input [A]."""
    voltage: float
    """At the servo [V]."""
    temperature: float
    """[degC]"""
    duty: float
    """[1]"""
    tip: tuple[float, float] | None
    """x and z of the fingertip [m]; ``None`` where there is none."""


class Plant:
    """Everything that moves, advanced by the millisecond.

    Args:
        unit: Its constants.
        seed: Of the sensors' noise.
        model: Which servo's control table it has.
        load_cell_rate: 80 or 10, the chip's own, or 20 [Hz].
        time_step: Substep [s]; must divide a millisecond.
    """

    def __init__(
        self,
        unit: Unit,
        *,
        seed: int = 0,
        model: ServoModel = XC330_T288_T,
        load_cell_rate: int = 80,
        time_step: float = TIME_STEP,
    ) -> None:
        self.unit = unit
        self._substeps = round(TICK / time_step)
        self._time_step = time_step
        self.motor = Motor(unit.servo)
        self.tendon = Tendon(unit.tendon)
        constants = unit.mechanism
        self.mechanism: Mechanism = (
            Slider(constants) if isinstance(constants, SliderConstants) else Finger(constants)
        )
        self.obstacle = Obstacle()
        self.encoder = Encoder(unit.servo, random.Random(f"encoder {seed}"), TICK)
        self.registers = Registers(model)
        self.registers.power_up(self.encoder.count)
        self.firmware = Firmware(self.registers, self.motor, self.encoder)
        self.load_cell = LoadCellBoard(
            unit.load_cell, random.Random(f"load cell {seed}"), load_cell_rate
        )
        self.ticks = 0
        for _ in range(REST_TICKS):
            self._move(0.0)
        self.motor.angle = self.motor.rate = 0.0

    @property
    def time(self) -> float:
        """Time since the plant started [s]."""
        return self.ticks * TICK

    def tick(self) -> bytes:
        """Advance by a millisecond; return what the load cell's board sent."""
        self.firmware.tick()
        self.ticks += 1
        time = self.ticks * TICK
        self.obstacle.advance(time)
        tension = self._move(time)
        if self.ticks % PROTECTION_TICKS == 0:
            self.motor.warm(PROTECTION_TICKS * TICK)
            self.firmware.protect(PROTECTION_TICKS * TICK)
        return self.load_cell.take(tension, time)

    def _move(self, time: float) -> float:
        """Advance the mechanics by a millisecond; return the mean tension at the load cell [N]."""
        motor, tendon, mechanism, obstacle = self.motor, self.tendon, self.mechanism, self.obstacle
        step, radius = self._time_step, self.unit.servo.spool_radius
        line = tendon.mechanism_side_stiffness
        total = 0.0
        for _ in range(self._substeps):
            tendon.settle(radius * motor.angle, mechanism.excursion)
            pull = tendon.mechanism_side
            stiffness = line if pull > 0.0 else 0.0
            if obstacle.now is not None:
                pull -= obstacle.push(mechanism.excursion, mechanism.excursion_rate, time)
            total += tendon.spool_side
            motor.advance(tendon.spool_side, step)
            mechanism.advance(pull, stiffness, step)
        return total / self._substeps

    def state(self) -> PlantState:
        """Return what is true now."""
        motor = self.motor
        return PlantState(
            time=self.time,
            angle=motor.angle,
            rate=motor.rate,
            tension=self.tendon.spool_side,
            excursion=self.mechanism.excursion,
            current=motor.input_current,
            voltage=motor.voltage,
            temperature=motor.temperature,
            duty=motor.duty,
            tip=self.mechanism.tip(),
        )
