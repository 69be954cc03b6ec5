"""When readings of the load cell were made, while they still come in."""

from collections import deque
from collections.abc import Sequence

from hardware.load_cells.base import LoadCellReading
from hardware.load_cells.clock_fit import READINGS_MIN, ClockFit, fit_clock, runs

HISTORY = 800
"""Readings that a fit looks back on: 10 s at 80 Hz. A crystal's rate holds much longer, so the line
is as good as over a whole run, and laying it takes about 2 ms."""
REFIT_PERIOD = 2.0
"""Time between two fits on the bench's clock [s]."""


class ReadingDates:
    """Dates readings by the microcontroller's own clock, laid under their arrivals.

    Until there are enough readings for that they are dated by arrival. The log keeps both clocks,
    so that a better fit can be made later.
    """

    def __init__(self) -> None:
        self._history: deque[LoadCellReading] = deque(maxlen=HISTORY)
        self._fit: ClockFit | None = None
        self._next = 0.0

    def instants(self, readings: Sequence[LoadCellReading]) -> list[float]:
        """Return when readings were made, on the bench's clock [s]."""
        if not readings:
            return []
        self._history.extend(readings)
        if readings[-1].host_time >= self._next:
            self._refit(readings[-1].host_time)
        if self._fit is None or len(runs([self._history[0], *readings])) > 1:
            return [reading.host_time for reading in readings]
        return self._fit.host_time(readings).tolist()

    def _refit(self, now: float) -> None:
        self._next = now + REFIT_PERIOD
        latest = runs(list(self._history))[-1]
        if len(latest) < len(self._history):  # the microcontroller has started anew
            self._history = deque(latest, maxlen=HISTORY)
        self._fit = fit_clock(latest) if len(latest) >= READINGS_MIN else None
        if self._fit is None:
            self._next = now
