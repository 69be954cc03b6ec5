"""The microcontroller's clock against the host's: when a reading was made, not when it arrived."""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tendon_hardware.errors import LoadCellSilent
from tendon_hardware.load_cells.framing import WORD
from tendon_hardware.load_cells.load_cell_type import LoadCellReading

Array = NDArray[np.float64]

SLOPE_LIMIT = 1e-3
"""Greatest credible error of the microcontroller's clock [1]: crystals keep 50 ppm, ceramic
resonators 5000 ppm at worst but 1000 ppm at room temperature."""
READINGS_MIN = 10  # Fewer readings give no slope


@dataclass(frozen=True, kw_only=True)
class ClockFit:
    r"""Straight line between the clocks over one run of the microcontroller.

    .. math:: t_{host} = t_0 + (1 + \epsilon) (t_{device} - t_{device,0})

    Transport only ever delays, so the line runs below all arrivals. The line has the least sum of
    delays of all such lines: an edge of the lower convex hull, the one over the mean. The least
    delay itself stays unknown. That delay is 0.1 ms through a microcontroller's own USB port. Where
    another chip makes the USB, the delay is the 3 ms that a line takes at 115200 baud.
    """

    device_start_us: int  # Device time of the first reading [us]
    host_start: float  # Host time of the first reading [s]
    error: float  # Relative error of the device's clock against the host's [1]
    delay_median: float  # Median of the arrivals' delay behind the line [s]
    delay_max: float  # Greatest delay behind the line [s]

    def host_time(self, readings: Sequence[LoadCellReading]) -> Array:
        """Return when readings of this run were made, on the host's clock [s], shape (T,)."""
        advance = unwrap(readings, self.device_start_us)
        return self.host_start + (1.0 + self.error) * advance


def fit_clock(readings: Sequence[LoadCellReading]) -> ClockFit:
    """Fit the clocks of one run of the microcontroller, first to last reading.

    Raises:
        LoadCellSilent: There are too few readings.
    """
    if len(readings) < READINGS_MIN:
        raise LoadCellSilent(
            f"{READINGS_MIN} readings are needed to date them; there are {len(readings)}"
        )
    device = unwrap(readings, readings[0].device_time_us)
    start = readings[0].host_time
    arrival = np.array([reading.host_time for reading in readings]) - start
    error, offset = line_below(device, arrival - device)
    delay = arrival - device - (offset + error * device)
    return ClockFit(
        device_start_us=readings[0].device_time_us,
        host_start=start + offset,
        error=error,
        delay_median=float(np.median(delay)),
        delay_max=float(delay.max()),
    )


def runs(readings: Sequence[LoadCellReading]) -> list[list[LoadCellReading]]:
    """Split readings where the microcontroller started anew: its sequence goes back."""
    found: list[list[LoadCellReading]] = []
    for reading in readings:
        # half the circle of 32 bits is a year and a half at 80 per second
        forward = found and 0 < (reading.sequence - found[-1][-1].sequence) % WORD < WORD // 2
        if not forward:
            found.append([])
        found[-1].append(reading)
    return found


def unwrap(readings: Sequence[LoadCellReading], start_us: int) -> Array:
    """Return the device's time since an instant [s], across the wraps of its 32 bits."""
    ticks = np.array([reading.device_time_us for reading in readings], dtype=np.int64)
    if ticks.size == 0:
        return np.zeros(0)
    steps = np.diff(ticks, prepend=start_us) % WORD
    # the first may lie before the start: a circle's second half counts backwards
    steps[0] -= WORD if steps[0] >= WORD // 2 else 0
    return np.cumsum(steps) * 1e-6


def line_below(x: Array, y: Array) -> tuple[float, float]:
    """Return slope and offset of the line below all points that is nearest to them in sum.

    The sum of the distances is least where the line is highest over the mean of ``x``, and the
    highest line below the points is there the lower convex hull.

    Args:
        x: Abscissae in ascending order, shape (T,).
        y: Ordinates, shape (T,).
    """
    points = list(zip(x.tolist(), y.tolist(), strict=True))
    hull: list[tuple[float, float]] = []
    for point in points:
        while len(hull) > 1 and not turns_left(hull[-2], hull[-1], point):
            hull.pop()
        hull.append(point)
    middle = float(x.mean())
    right = next((k for k, (abscissa, _) in enumerate(hull) if abscissa >= middle), 1)
    a, b = hull[max(right, 1) - 1], hull[max(right, 1)]
    slope = (b[1] - a[1]) / (b[0] - a[0]) if b[0] > a[0] else 0.0
    if abs(slope) > SLOPE_LIMIT:  # too short a run to tell a slope from a delay
        slope = 0.0
    return slope, float((y - slope * x).min())


def turns_left(a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]) -> bool:
    """Tell whether b lies below the line from a to c."""
    return (b[0] - a[0]) * (c[1] - a[1]) > (b[1] - a[1]) * (c[0] - a[0])


HISTORY = 800
"""Readings that a fit looks back on: 10 s at 80 Hz. A crystal's rate holds much longer, so the line
is as good as over a whole run, and laying it takes about 2 ms."""
REFIT_PERIOD = 2.0  # Time between two fits on the bench's clock [s]


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
