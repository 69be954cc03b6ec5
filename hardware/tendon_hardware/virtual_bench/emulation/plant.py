"""The bench as one system: servo, tendon, mechanism, what blocks it, and the load cell."""

import random
from collections.abc import Sequence
from dataclasses import dataclass
from math import dist

from tendon_hardware.virtual_bench.emulation.emulations import AnyModel, family_of
from tendon_hardware.virtual_bench.emulation.firmware import TICK
from tendon_hardware.virtual_bench.memory.control_table import XC330_T288_T
from tendon_hardware.virtual_bench.physics.antagonist import AntagonistFinger
from tendon_hardware.virtual_bench.physics.constants import (
    TIME_STEP,
    AntagonistConstants,
    HandBallConstants,
    HandConstants,
    SliderConstants,
)
from tendon_hardware.virtual_bench.physics.encoder import Encoder
from tendon_hardware.virtual_bench.physics.load_cell import LoadCellBoard, crc8
from tendon_hardware.virtual_bench.physics.mechanisms import (
    BenchMechanism,
    Finger,
    Slider,
    StringMechanism,
)
from tendon_hardware.virtual_bench.physics.motor import Motor
from tendon_hardware.virtual_bench.physics.obstacle import BenchObstacle
from tendon_hardware.virtual_bench.physics.scene import Pose, Scene, Still
from tendon_hardware.virtual_bench.physics.tendon import BenchTendon
from tendon_hardware.virtual_bench.physics.unit import BenchUnit, LineConstants

BALL_RADIUS = 0.025  # Of the ball whose marks the camera sees [m]
FIELD = 0.08
"""Distance from the middle of the first frame within which the camera sees the ball [m]."""


class BallCamera:
    """Finds a ball in each frame, with noise, and tells of it after a while.

    The lines are those that a `LineCamera` reads. The marks on the ball are found
    as well as its middle. A frame without a ball has no line.
    """

    def __init__(self, constants: HandBallConstants, rng: random.Random) -> None:
        self._constants = constants
        self._random = rng
        self._period = 1.0 / constants.camera_rate
        self._next = rng.uniform(0.0, self._period)
        self._sequence = 0
        self._middle: Sequence[float] | None = None

    @property
    def delay(self) -> float:
        """Time from a frame's exposure to its line [s]."""
        return self._constants.camera_delay

    def take(self, pose: Pose, time: float) -> bytes:
        """Look at the ball, its place [m] and quaternion; return the line of a frame, if any.

        The line is on its way for `delay`.
        """
        if time < self._next:
            return b""
        self._next += self._period
        self._sequence += 1
        self._middle = self._middle or pose[:3]
        if dist(pose[:3], self._middle) > FIELD:
            return b""
        noise = self._constants.camera_noise
        noises = 3 * (noise,) + 4 * (0.5 * noise / BALL_RADIUS,)  # half an angle is in a quaternion
        seen = [
            round(1e6 * (v + n * self._random.gauss())) for v, n in zip(pose, noises, strict=True)
        ]
        text = b"B,%d,%d,%d,%d,%d,%d,%d,%d,%d" % (self._sequence, round(1e6 * self.delay), *seen)
        return text + b"*%02X\n" % crc8(text)


class DriveLine:
    """Motor, gear and firmware of a servo, the line that it winds, and what measures its tension.

    Args:
        noise: Words that tell its noise from other lines'.
        load_cell_rate: 80 or 10, the chip's own, or 20 [Hz].
    """

    def __init__(
        self, constants: LineConstants, noise: str, *, model: AnyModel, load_cell_rate: int
    ) -> None:
        self.constants = constants
        self.motor = Motor(constants.servo)
        self.tendon = BenchTendon(constants.tendon)
        self.encoder = Encoder(constants.servo, random.Random(f"encoder {noise}"), TICK)
        self.family = family_of(model)
        self.registers = self.family.registers(model)
        self.registers.power_up(self.encoder.count)
        self.firmware = self.family.firmware(self.registers, self.motor, self.encoder)
        self.load_cell = LoadCellBoard(
            constants.load_cell, random.Random(f"load cell {noise}"), load_cell_rate
        )


PROTECTION_TICKS = 10  # Ticks between two looks at voltage and warmth
REST_TICKS = 1500  # Ticks in which the mechanism comes to rest before time starts


@dataclass(frozen=True, kw_only=True, slots=True)
class PlantState:
    """The true state at an instant, which no sensor reads so well; the first of several servos."""

    time: float  # [s] since the plant started
    angle: float  # Angle of the spool from where the tendon was homed [rad]
    rate: float  # [rad/s]
    tension: float  # At the load cell [N]
    excursion: float  # Line that the mechanism has given [m]
    current: float  # At the power input [A]
    voltage: float  # At the servo [V]
    temperature: float  # [degC]
    duty: float  # [1]
    tip: tuple[float, float] | None  # x and z of the fingertip [m]; ``None`` where there is none
    joints: tuple[float, ...] = ()  # Joint angles of a hand, finger by finger [rad]
    # Place [m] and quaternion (x, y, z, w) of the ball in a hand, where there is one
    ball: Pose | None = None


class Plant:
    """Everything that moves, advanced by the millisecond.

    Args:
        load_cell_rate: 80 or 10, the chip's own, or 20 [Hz].
        time_step: Substep [s]; must divide a millisecond.
        still: Whether nothing gives line, as while masses hang on the load cells.
    """

    def __init__(
        self,
        unit: BenchUnit,
        *,
        model: AnyModel = XC330_T288_T,
        load_cell_rate: int = 80,
        time_step: float = TIME_STEP,
        still: bool = False,
    ) -> None:
        self.unit = unit
        self._substeps = round(TICK / time_step)
        self._time_step = time_step
        self.lines = tuple(
            DriveLine(
                constants,
                f"{unit.seed} {place}" if place else f"{unit.seed}",
                model=model,
                load_cell_rate=load_cell_rate,
            )
            for place, constants in enumerate(unit.lines)
        )
        """Servos with their tendons, in the order of the asset's."""
        first = self.lines[0]
        self.motor, self.tendon, self.encoder = first.motor, first.tendon, first.encoder
        self.registers, self.firmware = first.registers, first.firmware
        self.load_cell = first.load_cell
        self.mechanism = Still(len(self.lines)) if still else mechanism_of(unit)
        self.camera = camera_of(unit)  # Looks at the ball, where there is one
        self.obstacle = BenchObstacle()
        self.ticks = 0
        for _ in range(0 if still else REST_TICKS):
            self._move(0.0)
        for line in self.lines:
            line.motor.angle = line.motor.rate = 0.0

    @property
    def time(self) -> float:
        """Time since the plant started [s]."""
        return self.ticks * TICK

    def tick(self) -> tuple[bytes, ...]:
        """Advance by a millisecond; return what each load cell's board sent."""
        for line in self.lines:
            line.firmware.tick()
        self.ticks += 1
        time = self.ticks * TICK
        self.obstacle.advance(time)
        tensions = self._move(time)
        if self.ticks % PROTECTION_TICKS == 0:
            for line in self.lines:
                line.motor.warm(PROTECTION_TICKS * TICK)
                line.firmware.protect(PROTECTION_TICKS * TICK)
        return tuple(
            line.load_cell.take(tension, time)
            for line, tension in zip(self.lines, tensions, strict=True)
        )

    def _move(self, time: float) -> tuple[float, ...]:
        """Advance the mechanics by a millisecond; return the mean tensions at the cells [N]."""
        if isinstance(self.mechanism, Slider | Finger):
            return (self._move_alone(self.mechanism, time),)
        return self._move_between(self.mechanism, time)

    def _move_between(self, mechanism: StringMechanism, time: float) -> tuple[float, ...]:
        """Advance what several servos pull; an obstacle meets the first one's string."""
        lines, obstacle, step = self.lines, self.obstacle, self._time_step
        totals = [0.0] * len(lines)
        for _ in range(self._substeps):
            pulls: list[float] = []
            stiffnesses: list[float] = []
            for line, excursion in zip(lines, mechanism.excursions, strict=True):
                tendon = line.tendon
                tendon.settle(line.constants.servo.spool_radius * line.motor.angle, excursion)
                pulls.append(tendon.mechanism_side)
                taut = tendon.mechanism_side > 0.0
                stiffnesses.append(tendon.mechanism_side_stiffness if taut else 0.0)
            if obstacle.now is not None:
                pulls[0] -= obstacle.push(
                    mechanism.excursions[0], mechanism.excursion_rates[0], time
                )
            for place, line in enumerate(lines):
                totals[place] += line.tendon.spool_side
                line.motor.advance(line.tendon.spool_side, step)
            mechanism.advance(pulls, stiffnesses, step)
        return tuple(total / self._substeps for total in totals)

    def _move_alone(self, mechanism: BenchMechanism, time: float) -> float:
        """Advance what one servo pulls."""
        motor, tendon, obstacle = self.motor, self.tendon, self.obstacle
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
        motor, mechanism = self.motor, self.mechanism
        alone = isinstance(mechanism, Slider | Finger)
        scene = mechanism if isinstance(mechanism, Scene) else None
        return PlantState(
            time=self.time,
            angle=motor.angle,
            rate=motor.rate,
            tension=self.tendon.spool_side,
            excursion=mechanism.excursion if alone else mechanism.excursions[0],
            current=motor.input_current,
            voltage=motor.voltage,
            temperature=motor.temperature,
            duty=motor.duty,
            tip=mechanism.tip(),
            joints=() if scene is None else scene.joints(),
            ball=None if scene is None else scene.ball(),
        )

    def look(self) -> bytes:
        """Let the camera look at the ball; return the line of a frame that is complete."""
        if self.camera is None or not isinstance(self.mechanism, Scene):
            return b""
        ball = self.mechanism.ball()
        assert ball is not None
        return self.camera.take(ball, self.time)

    def put_ball_back(self) -> None:
        """Lay the ball where it starts, as a hand would; without a ball nothing happens."""
        if isinstance(self.mechanism, Scene):
            self.mechanism.put_back()


def camera_of(unit: BenchUnit) -> BallCamera | None:
    """Return what looks at a unit's ball, where there is one."""
    constants = unit.mechanism
    if not isinstance(constants, HandBallConstants):
        return None
    return BallCamera(constants, random.Random(f"camera {unit.seed}"))


def mechanism_of(unit: BenchUnit) -> Slider | Finger | StringMechanism:
    """Return what a unit's tendons pull."""
    constants = unit.mechanism
    if isinstance(constants, SliderConstants):
        return Slider(constants)
    if isinstance(constants, AntagonistConstants):
        return AntagonistFinger(constants)
    if isinstance(constants, HandConstants):
        return Scene(unit.bench, constants)
    return Finger(constants)
