"""The steady rate of a loop: deadlines are absolute, what is overrun is skipped, nothing bursts."""

import time

import numpy as np
import pytest

from tendon_hardware.clock import MonotonicClock
from tendon_hardware.load_cells.clock_fit import ReadingDates
from tendon_hardware.load_cells.load_cell_type import LoadCellReading
from tendon_hardware.pacing import Ticker


class ModelClock:
    """A clock that is told how late it wakes."""

    def __init__(self, lateness: tuple[float, ...] = (0.0,)) -> None:
        self.time = 100.0
        self.lateness = lateness
        self.wakings = 0

    def now(self) -> float:
        """Return the time [s]."""
        return self.time

    def sleep_until(self, instant: float) -> None:
        """Wake late."""
        late = self.lateness[self.wakings % len(self.lateness)]
        self.wakings += 1
        self.time = max(self.time, instant + late)


def test_lateness_does_not_add_up() -> None:
    """Waking 2 ms late every time, tick 4800 at 80 Hz is due at 60 s all the same."""
    clock = ModelClock((2e-3,))
    ticker = Ticker(clock, 80.0)
    for tick in range(4801):
        assert ticker.wait() == tick
        clock.time += 3e-3  # what a tick's work takes
    assert clock.time - 3e-3 - ticker.start == pytest.approx(60.0 + 2e-3, abs=1e-6)
    assert ticker.report().overruns == 0


def test_an_overrun_is_skipped_and_counted() -> None:
    """Work of 3.5 periods costs three ticks; the next comes at its own deadline, not at once."""
    clock = ModelClock()
    ticker = Ticker(clock, 100.0)
    assert ticker.wait() == 0
    clock.time += 0.035
    assert ticker.wait() == 3, "due at 30 ms, late by 5 ms, and not yet over"
    assert ticker.wait() == 4
    assert clock.time - ticker.start == pytest.approx(0.04)
    report = ticker.report()
    assert report.overruns == 2
    assert report.ticks == 3
    assert report.worst == pytest.approx(5e-3)


def test_ticks_never_burst(rng: np.random.Generator) -> None:
    """However long the work takes, two ticks with a number between them never follow at once."""
    clock = ModelClock()
    ticker = Ticker(clock, 80.0)
    last = ticker.wait()
    for work in rng.exponential(0.01, 2000):
        clock.time += work
        tick = ticker.wait()
        assert tick > last
        assert clock.time >= ticker.start + tick / 80.0
        assert clock.time < ticker.start + (tick + 1) / 80.0, "a tick that is over does not run"
        last = tick
    assert ticker.index + 1 == ticker.ticks + ticker.overruns


def test_percentiles_are_those_of_the_lateness(rng: np.random.Generator) -> None:
    """The histogram gives median and 99 % to its resolution of 20 us."""
    lateness = tuple(rng.gamma(2.0, 2e-4, 5000))
    ticker = Ticker(ModelClock(lateness), 100.0)
    for _ in range(5000):
        ticker.wait()
    report = ticker.report()
    assert report.median == pytest.approx(np.median(lateness), abs=3e-5)
    assert report.p99 == pytest.approx(np.percentile(lateness, 99.0), abs=5e-5)
    assert report.worst == pytest.approx(max(lateness))


@pytest.mark.parametrize("spin", [0.0, 5e-4])
def test_the_real_clock_never_wakes_early(spin: float) -> None:
    """With and without a spin at the end, an instant is reached and not passed by much."""
    clock = MonotonicClock(spin)
    for k in range(20):
        instant = clock.now() + 1e-3 * (k % 4)
        clock.sleep_until(instant)
        assert clock.now() >= instant
    begin = time.monotonic()
    clock.sleep_until(begin - 1.0)
    assert time.monotonic() - begin < 0.1, "what has passed is no wait"


def readings(
    count: int, rng: np.random.Generator, *, start: float = 50.0, first: int = 0
) -> tuple[list[LoadCellReading], np.ndarray]:
    """Make readings at 80 Hz of a clock 80 ppm fast that arrive 1 ms late and more."""
    made = start + np.arange(count) / 80.0
    late = 1e-3 + rng.exponential(6e-4, count)
    arrived = np.maximum.accumulate(made + late)
    micros = (4_294_000_000 + (made - start) * (1.0 + 8e-5) * 1e6).astype(np.int64) % 2**32
    return [
        LoadCellReading(
            sequence=first + k, device_time_us=int(micros[k]), host_time=float(arrived[k]), counts=0
        )
        for k in range(count)
    ], made


def test_readings_are_dated_to_a_tenth_of_the_transports_scatter(rng: np.random.Generator) -> None:
    """After 2 s dates keep a constant distance from the truth, the least delay, within 0.2 ms.

    The microcontroller's clock wraps on the way, and is 80 ppm fast.
    """
    came, made = readings(2400, rng)
    dates = ReadingDates()
    dated = np.concatenate([dates.instants(came[k : k + 2]) for k in range(0, 2400, 2)])
    offset = (dated - made)[160:]
    assert np.abs(offset - 1e-3).max() < 2e-4
    assert np.all(np.diff(dated) > 0.0)


def test_a_restarted_microcontroller_is_dated_anew(rng: np.random.Generator) -> None:
    """Its sequence and clock begin again, and two seconds later the dates are as good as before."""
    dates = ReadingDates()
    before, _ = readings(400, rng)
    after, made = readings(800, rng, start=57.0, first=3)
    for k in range(0, 400, 2):
        dates.instants(before[k : k + 2])
    dated = np.concatenate([dates.instants(after[k : k + 2]) for k in range(0, 800, 2)])
    assert np.abs(dated - made).max() < 0.01, "never worse than the arrivals"
    assert np.abs((dated - made)[400:] - 1e-3).max() < 3e-4


def test_nothing_is_dated_where_nothing_came() -> None:
    """An empty look gives no date."""
    assert ReadingDates().instants([]) == []
