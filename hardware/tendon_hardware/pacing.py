"""A steady rate: absolute deadlines, lateness measured, what was overrun skipped and counted."""

from dataclasses import dataclass
from math import floor

from tendon_hardware.clock import Clock
from tendon_newton.errors import InvalidParameter

BIN = 2.0e-5  # Resolution of the lateness percentiles [s]
BINS = 5000  # Bins of the lateness histogram: 0.1 s, beyond which all is late alike


@dataclass(frozen=True, kw_only=True, slots=True)
class PacingReport:
    """Steadiness of a rate: late and lost ticks."""

    ticks: int  # Ticks that ran
    overruns: int  # Ticks that were skipped, because the one before lasted too long
    median: float  # Median lateness of a tick [s]
    p99: float  # Lateness that 99 % of the ticks stay below [s]
    worst: float  # Greatest lateness of a tick that was not skipped [s]

    @property
    def text(self) -> str:
        """The figures as a line."""
        return (
            f"{self.ticks} ticks, {self.overruns} skipped; late by {1e3 * self.median:.2f} ms "
            f"(median), {1e3 * self.p99:.2f} ms (99 %), {1e3 * self.worst:.2f} ms (worst)"
        )


def refuse_rates(rate: float, slower: float, whose: str) -> None:
    """Refuse a rate of ticks that no bus keeps, or that no slower rate [Hz] divides.

    Raises:
        InvalidParameter: The rate is not 10 to 500 Hz, or no whole multiple of the slower one.
    """
    if not 10.0 <= rate <= 500.0:
        raise InvalidParameter(f"the rate must be 10 to 500 Hz; it is {rate:g} Hz")
    ratio = rate / slower if slower > 0.0 else 0.0
    if ratio < 1.0 or abs(ratio - round(ratio)) > 1e-9:
        raise InvalidParameter(
            f"the rate must be a whole multiple of {whose}; they are {rate:g} and {slower:g} Hz"
        )


class Ticker:
    """Waits for the ticks of a steady rate.

    Tick ``k`` is due at ``start + k / rate``, whatever happened before, so errors do not add up.
    A tick whose whole period has passed is skipped: the next one is not hurried.

    Args:
        rate: Ticks per second [Hz].
    """

    def __init__(self, clock: Clock, rate: float) -> None:
        self.clock = clock
        self.rate = rate
        self.start = clock.now()
        self.index = -1
        self.ticks = 0
        self.overruns = 0
        self.worst = 0.0
        self.histogram = [0] * (BINS + 1)

    def restart(self) -> None:
        """Begin anew: the next tick is tick 0 and due now."""
        self.start, self.index = self.clock.now(), -1

    def wait(self) -> int:
        """Wait for the next tick and return its number."""
        due = self.index + 1
        passed = floor((self.clock.now() - self.start) * self.rate)
        if passed > due:
            self.overruns += passed - due
            due = passed
        instant = self.start + due / self.rate
        self.clock.sleep_until(instant)
        self.index = due
        self.count(self.clock.now() - instant)
        return due

    def count(self, lateness: float) -> None:
        """Enter the lateness of a tick [s] into the histogram."""
        self.ticks += 1
        self.worst = max(self.worst, lateness)
        self.histogram[min(max(int(lateness / BIN), 0), BINS)] += 1

    def report(self) -> PacingReport:
        """Return how well the rate was kept so far."""
        return PacingReport(
            ticks=self.ticks,
            overruns=self.overruns,
            median=self.percentile(0.5),
            p99=self.percentile(0.99),
            worst=self.worst,
        )

    def percentile(self, fraction: float) -> float:
        """Return the lateness that a fraction of the ticks does not exceed [s], to a bin above."""
        below = 0
        for place, count in enumerate(self.histogram):
            below += count
            if below >= fraction * self.ticks:
                return min((place + 1) * BIN, self.worst)
        return self.worst
