"""Faults of the camera that looks at a hand's ball: what it tells wrongly is not believed."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tendon_hardware.benches.bench import Bench
from tendon_hardware.benches.bench_address import BenchAddress
from tendon_hardware.cameras.line_camera import LineCamera
from tendon_hardware.deployment.ball_watch import BLIND, BallWatch
from tendon_hardware.load_cells.framing import crc8
from tendon_newton.data.cards.turning_task import TurningTask
from tests.hardware.silent_operator import SilentOperator

PERIOD = 1.0 / 30.0  # Time between frames [s]
DELAY = 0.075  # From a frame's exposure to its line [s]
BEGIN = 2.0  # When faults begin [s]
LENGTH = 6.0  # How long they are looked at [s]

Told = Callable[[int, float], tuple[int, float, float] | None]
"""Makes of a frame's number and time [s] what is told of it: number, age [s], and the share of the
camera's noise about its place, which is that of the fault's begin where it is none; None where
nothing is told."""


@dataclass(frozen=True, kw_only=True)
class CameraFault:
    """What is told from an instant on, and whether the ball must count as lost."""

    told: Told
    lost: bool
    turn: int = 1_000_000  # Last part of the quaternion whose others are 0 [1e-6]

    def examine(self, k: int) -> float | None:
        """Watch, and require what must come of it; return the time to a lost ball [s]."""
        bench = ScriptedBench(self, BEGIN + 0.0137 * k, np.random.default_rng(k))
        lost = bench.watch()
        assert (lost is not None) is self.lost, lost
        assert lost is None or lost <= BLIND + PERIOD, f"{lost:.3f} s"
        return lost


class ScriptedBench:
    """A clock, and a stream of lines about a ball that lies in its cup."""

    name = "a script"

    def __init__(self, fault: CameraFault, begin: float, rng: np.random.Generator) -> None:
        self._fault, self._begin, self._rng = fault, begin, rng
        self._now = 0.0
        self._frame = 0
        self._place = np.zeros(3)

    def now(self) -> float:
        """Return the instant [s]."""
        return self._now

    def sleep_until(self, instant: float) -> None:
        """Let time pass."""
        self._now = instant

    def open(self) -> None:
        """Begin."""

    def close(self) -> None:
        """End."""

    def receive(self) -> list[tuple[float, bytes]]:
        """Return the lines that have come since the last call."""
        pieces = []
        while (arrived := self._frame * PERIOD + DELAY) <= self._now:
            self._frame += 1
            noise = self._rng.normal(0.0, 1000.0, 3)
            said, turn = (self._frame, DELAY, 1.0), 1_000_000
            if arrived >= self._begin:
                said = self._fault.told(self._frame, arrived - self._begin)
                turn = self._fault.turn
            if said is None:
                continue
            number, age, share = said
            if share == 1.0:
                self._place = noise
            place = (noise if share == 1.0 else self._place + share * noise).astype(int)
            text = b"B,%d,%d,%d,%d,%d,0,0,0,%d" % (number, round(1e6 * age), *place, turn)
            pieces.append((arrived, text + b"*%02X\n" % crc8(text)))
        return pieces

    def watch(self) -> float | None:
        """Watch the ball; return the time from the fault to a ball that counts as lost [s]."""
        address = BenchAddress(bench="hand_ball", port="/dev/none")
        bench = Bench(address=address, drives=(), clock=self, camera=LineCamera(self, clock=self))
        watch = BallWatch(bench, TASK, SilentOperator())
        watch.open()
        while self._now < self._begin + LENGTH:
            self._now += 0.0125
            watch.take(None)
            if watch.lost:
                return self._now - self._begin
        return None


TASK = TurningTask(asset="hand_ball", axis=(0.0, 0.0, 1.0), drop_distance=0.03)
GREATEST = 9_999_999_999
CAMERA: dict[str, CameraFault] = {
    "a camera that is silent": CameraFault(told=lambda n, t: None, lost=True),
    "one line with the greatest number": CameraFault(
        told=lambda n, t: (GREATEST if t < PERIOD else n, DELAY, 1.0), lost=False
    ),
    "a camera's program that begins anew": CameraFault(
        told=lambda n, t: (round(t / PERIOD) + 1, DELAY, 1.0), lost=False
    ),
    "a number that stays": CameraFault(told=lambda n, t: (60, DELAY, 1.0), lost=True),
    "a place that stays": CameraFault(told=lambda n, t: (n, DELAY, 0.0), lost=True),
    "a place that stays, with a tenth of its noise": CameraFault(
        told=lambda n, t: (n, DELAY, 0.1), lost=True
    ),
    "quaternions of zero": CameraFault(told=lambda n, t: (n, DELAY, 1.0), lost=True, turn=0),
    "frames 90 s old": CameraFault(told=lambda n, t: (n, 90.0, 1.0), lost=True),
    "every third line": CameraFault(
        told=lambda n, t: (n, DELAY, 1.0) if n % 3 == 0 else None, lost=False
    ),
}
"""Faults of a camera."""
