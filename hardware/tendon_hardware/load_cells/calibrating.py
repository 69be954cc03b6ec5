"""The calibration procedure: tare, masses up, masses down, tare, with a steady reading of each."""

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import isfinite, sqrt
from typing import Protocol

import numpy as np

from tendon_hardware.clock import Clock
from tendon_hardware.errors import InvalidCalibration, LoadCellSilent
from tendon_hardware.load_cells.calibration import MASSES_MIN, CalibrationPoint, Direction, listed
from tendon_hardware.load_cells.framing import WORD
from tendon_hardware.load_cells.load_cell_type import LoadCell, LoadCellReading

POLL_PERIOD = 0.02  # Pause between looks at the cell [s]
SILENCE_LIMIT = 3.0  # Longest wait for a reading [s]; a cell at 10 per second starts within 0.4 s
STEADY_TIME = 1.5  # Readings that must agree before a measurement begins [s]
STEADY_LIMIT = 60.0  # Longest wait for them [s]; a swinging mass calms down in ten
MASS_LIMIT = 100.0  # [kg] no string of a finger carries; a mass in grams is beyond
SWING_FACTOR = 5.0
"""Scatter of a mass at rest, at most, as a multiple of the scatter without one [1]."""
SIGNIFICANCE = 4.0
"""Standard errors by which the halves of a window may differ [1]: one in 16,000 by chance."""


class CalibrationOperator(Protocol):
    """Whoever hangs the masses."""

    def hang(self, mass: float, text: str) -> None:
        """Hang a mass [kg], 0 for none, and return when it hangs."""

    def show(self, counts: float, sigma: float) -> None:
        """Be shown the mean and scatter of the latest readings [counts]."""


def await_steady(
    cell: LoadCell, clock: Clock, operator: CalibrationOperator, calm: float | None
) -> None:
    """Wait until readings neither drift nor swing; calm is their scatter without load [counts]."""
    deadline = clock.now() + STEADY_LIMIT
    window: deque[LoadCellReading] = deque()
    while clock.now() < deadline:
        window.extend(take(cell, clock, 0.25, operator))
        while window and window[-1].host_time - window[0].host_time > STEADY_TIME:
            window.popleft()
        full = window and window[-1].host_time - window[0].host_time > 0.8 * STEADY_TIME
        if full and is_steady([reading.counts for reading in window], calm):
            return
    raise InvalidCalibration(
        f"the readings must come to rest; for {STEADY_LIMIT:g} s they drifted or swung: "
        "see that the mass hangs still and nothing pulls on the cell's wires"
    )


def is_steady(counts: Sequence[int], calm: float | None) -> bool:
    """Tell whether readings scatter about one value, and no more than without load."""
    half = len(counts) // 2
    if half < 4:
        return False
    first, second = np.array(counts[:half]), np.array(counts[half:])
    sigma = max(sqrt(0.5 * float(first.var(ddof=1) + second.var(ddof=1))), 1.0)
    drift = abs(float(second.mean() - first.mean()))
    swings = calm is not None and sigma > SWING_FACTOR * max(calm, 1.0)
    # readings of a filtered cell are not independent: two by two, as a rule
    return not swings and drift <= SIGNIFICANCE * sigma * sqrt(2.0 * 2.0 / half)


def take(
    cell: LoadCell, clock: Clock, duration: float, operator: CalibrationOperator
) -> list[LoadCellReading]:
    """Collect the readings of a time [s].

    Raises:
        InvalidCalibration: One of them is at an end of the converter's range.
        LoadCellSilent: No reading comes.
    """
    end = clock.now() + duration
    last = clock.now()
    readings: list[LoadCellReading] = []
    while clock.now() < end or not readings:
        clock.sleep_until(clock.now() + POLL_PERIOD)
        fresh = cell.drain()
        if any(reading.saturated for reading in fresh):
            raise InvalidCalibration(
                "the cell must stay inside its range; it is saturated: use a lower gain or a "
                "smaller mass, and look at its wires"
            )
        if fresh:
            last = clock.now()
            readings += fresh
            counts = [reading.counts for reading in readings[-20:]]
            operator.show(float(np.mean(counts)), float(np.std(counts)))
        elif clock.now() - last > SILENCE_LIMIT:
            raise LoadCellSilent(
                f"a load cell must send readings; none came for {SILENCE_LIMIT:g} s "
                f"({cell.counters.lines} before, {cell.counters.rejected} broken lines): look at "
                "its plug, its rate and its program"
            )
    return readings


TARE_TIME, HOLD_TIME = 5.0, 3.0  # Lengths of a measurement without load and with a mass [s]


@dataclass(frozen=True, kw_only=True, slots=True)
class CalibrationPlan:
    """Masses and their order."""

    masses: tuple[float, ...]  # Known masses [kg]

    def __post_init__(self) -> None:
        masses = set(self.masses)
        if not all(isfinite(mass) and 0.0 < mass <= MASS_LIMIT for mass in masses):
            raise InvalidCalibration(
                f"masses must be above 0 and at most {MASS_LIMIT:g} kg (divide grams by 1000); "
                f"they are {listed(sorted(masses))}"
            )
        if len(masses) < MASSES_MIN:
            raise InvalidCalibration(
                f"a calibration needs {MASSES_MIN} different masses; these are {len(masses)}: "
                f"{listed(sorted(masses))}"
            )

    @property
    def steps(self) -> tuple[tuple[float, Direction], ...]:
        """Mass [kg] and direction of each measurement; the greatest is hung once."""
        masses = (0.0, *sorted(set(self.masses)))
        up: tuple[tuple[float, Direction], ...] = tuple((mass, "up") for mass in masses)
        return (*up, *((mass, "down") for mass in reversed(masses[:-1])))


def run_plan(
    plan: CalibrationPlan,
    cell: LoadCell,
    clock: Clock,
    operator: CalibrationOperator,
    done: Sequence[CalibrationPoint] = (),
    keep: Callable[[Sequence[CalibrationPoint]], None] = lambda _: None,
) -> tuple[list[CalibrationPoint], float]:
    """Measure every step of a plan that is not done yet.

    Args:
        done: Points of an interrupted run, a beginning of the plan.
        keep: Called with all points after each measurement, so that none is lost.

    Returns:
        All points in the plan's order, and readings per second by the cell's own clock [1/s].

    Raises:
        InvalidCalibration: The cell is saturated, or does not come to rest.
        LoadCellSilent: The cell sends no readings.
    """
    points = list(done)
    rate = 0.0
    steps = plan.steps
    for number, (mass, direction) in enumerate(steps[len(points) :], start=len(points) + 1):
        load = f"hang {mass:g} kg" if mass else "take all load off"
        operator.hang(mass, f"{number}/{len(steps)}: {load}, and wait until it hangs still")
        cell.drain()  # what arrived while the operator was busy
        calm = points[0].sigma if points else None
        await_steady(cell, clock, operator, calm)
        readings = take(cell, clock, HOLD_TIME if mass else TARE_TIME, operator)
        rate = reading_rate(readings)
        points.append(point(readings, mass, direction))
        keep(points)
    if not rate:  # nothing was left to measure
        rate = sum(p.readings for p in points) / sum(p.duration for p in points)
    return points, rate


def point(
    readings: Sequence[LoadCellReading], mass: float, direction: Direction
) -> CalibrationPoint:
    """Make a point of readings under one mass."""
    counts = np.array([reading.counts for reading in readings], dtype=np.float64)
    return CalibrationPoint(
        mass=mass,
        direction=direction,
        counts=float(counts.mean()),
        sigma=float(counts.std(ddof=1)) if counts.size > 1 else 0.0,
        readings=counts.size,
        duration=readings[-1].host_time - readings[0].host_time,
    )


def reading_rate(readings: Sequence[LoadCellReading]) -> float:
    """Return the readings per second by the cell's own clock [1/s], lost ones counted."""
    first, last = readings[0], readings[-1]
    steps = (last.sequence - first.sequence) % WORD
    elapsed = (last.device_time_us - first.device_time_us) % WORD * 1e-6
    return steps / elapsed if elapsed > 0.0 else 0.0
