"""Readings that have come to rest: neither drifting nor swinging."""

from collections import deque
from collections.abc import Sequence
from math import sqrt
from typing import Protocol

import numpy as np

from tendon_hardware.clock import Clock
from tendon_hardware.errors import InvalidCalibration, LoadCellSilent
from tendon_hardware.load_cells.load_cell_type import LoadCell, LoadCellReading

POLL_PERIOD = 0.02
"""Pause between looks at the cell [s]."""
SILENCE_LIMIT = 3.0
"""Longest wait for a reading [s]; a cell at 10 per second starts within 0.4 s."""
STEADY_TIME = 1.5
"""Readings that must agree before a measurement begins [s]."""
STEADY_LIMIT = 60.0
"""Longest wait for them [s]; a swinging mass calms down in ten."""
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
    """Wait until the readings neither drift nor swing.

    Args:
        calm: Scatter without load [counts], where it is known.
    """
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
