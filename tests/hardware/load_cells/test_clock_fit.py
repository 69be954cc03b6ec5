"""When a reading was made, from two clocks and arrivals that are late."""

import numpy as np
import pytest

from tendon_hardware.errors import LoadCellSilent
from tendon_hardware.load_cells.clock_fit import fit_clock, line_below, runs, unwrap
from tendon_hardware.load_cells.hx711_serial import Hx711Serial
from tendon_hardware.load_cells.load_cell_type import LoadCellReading
from tendon_hardware.virtual_bench import LockstepBench

PERIOD = 0.0125


def readings_of(
    true: np.ndarray, delay: np.ndarray, error: float, start: float = 1.0
) -> list[LoadCellReading]:
    """Make readings whose device clock errs, and which arrive late [s]."""
    device = start + true * (1.0 + error)
    return [
        LoadCellReading(
            sequence=k,
            device_time_us=round(1e6 * device[k]) % 2**32,
            host_time=float(true[k] + delay[k]),
            counts=0,
        )
        for k in range(true.size)
    ]


@pytest.mark.parametrize("error", [-80e-6, 0.0, 200e-6])
def test_readings_are_dated_to_a_fifth_of_a_millisecond(
    rng: np.random.Generator, error: float
) -> None:
    """A minute at 80 Hz with delays of 0.6 ms in the mean and now and then 8 ms."""
    true = PERIOD * np.arange(4800.0)
    delay = rng.exponential(0.6e-3, true.size) + 8e-3 * (rng.random(true.size) < 0.01)
    readings = readings_of(true, delay, error)
    fit = fit_clock(readings)
    assert np.abs(fit.host_time(readings) - true).max() < 0.2e-3
    assert fit.error == pytest.approx(-error, abs=5e-6)
    assert fit.delay_median == pytest.approx(0.6e-3 * np.log(2.0), abs=0.1e-3)


def test_delays_that_drift_do_not_bend_the_line(rng: np.random.Generator) -> None:
    """Arrivals late by a slow sawtooth, as of a loop that looks at nearly the cell's rate."""
    true = PERIOD * np.arange(4800.0)
    delay = 5e-3 * ((true / 7.0) % 1.0) + rng.exponential(0.1e-3, true.size)
    readings = readings_of(true, delay, 50e-6)
    assert np.abs(fit_clock(readings).host_time(readings) - true).max() < 0.5e-3


def test_the_least_delay_stays_in_the_dates(rng: np.random.Generator) -> None:
    """No fit can see it: 3 ms for every reading shift all dates by 3 ms."""
    true = PERIOD * np.arange(800.0)
    readings = readings_of(true, 3e-3 + rng.exponential(0.3e-3, true.size), 0.0)
    shift = fit_clock(readings).host_time(readings) - true
    assert shift == pytest.approx(np.full(true.size, 3e-3), abs=0.1e-3)


def test_a_virtual_cell_is_dated_by_its_true_clock() -> None:
    """Through bytes, lines and the driver: the scatter of the transport is gone."""
    bench = LockstepBench("finger", 4)
    cell = Hx711Serial(bench.load_cell_stream(), clock=bench.clock)
    cell.open()
    readings = []
    for tick in range(1, 2400):
        bench.clock.sleep_until(tick * PERIOD)
        readings += cell.drain()
    dates = fit_clock(readings).host_time(readings)
    arrivals = np.array([reading.host_time for reading in readings])
    ticks = 1e3 * np.diff(dates)  # its plant advances by the millisecond
    assert np.abs(ticks - np.round(ticks)).max() < 0.02
    assert (arrivals - dates).max() > 2e-3  # otherwise this shows nothing
    assert (arrivals - dates).min() == pytest.approx(0.0, abs=1e-9)


def test_the_device_clock_may_wrap(rng: np.random.Generator) -> None:
    """32 bits of microseconds wrap every 71.6 minutes."""
    true = PERIOD * np.arange(800.0)
    readings = readings_of(true, rng.exponential(0.3e-3, true.size), 20e-6, start=4290.0)
    assert readings[-1].device_time_us < readings[0].device_time_us
    assert np.abs(fit_clock(readings).host_time(readings) - true).max() < 0.2e-3


def test_a_fit_dates_earlier_readings_too() -> None:
    """A line laid late in a run serves its beginning."""
    true = PERIOD * np.arange(800.0)
    readings = readings_of(true, np.zeros(800), 0.0)
    fit = fit_clock(readings[400:])
    assert fit.host_time(readings[:10]) == pytest.approx(true[:10], abs=1e-5)
    assert unwrap([], 0).size == 0


def test_restarts_split_the_readings() -> None:
    """Each run of the microcontroller has its own line."""
    true = PERIOD * np.arange(20.0)
    once = readings_of(true, np.zeros(20), 0.0)
    assert [len(run) for run in runs([*once, *once[:5]])] == [20, 5]
    assert runs([]) == []


def test_too_few_readings_give_no_line() -> None:
    """Nine say nothing about a slope."""
    with pytest.raises(LoadCellSilent, match="10 readings are needed to date them; there are 9"):
        fit_clock(readings_of(PERIOD * np.arange(9.0), np.zeros(9), 0.0))


def test_a_short_run_takes_the_clocks_as_equal(rng: np.random.Generator) -> None:
    """An eighth of a second cannot tell a slope of 1000 ppm from a delay."""
    true = PERIOD * np.arange(10.0)
    readings = readings_of(true, rng.exponential(3e-3, 10), 0.0)
    assert abs(fit_clock(readings).error) <= 1e-3


def test_the_line_below_is_the_nearest_of_all(rng: np.random.Generator) -> None:
    """No line through two points that stays below all is nearer in sum."""
    x = np.sort(rng.uniform(0.0, 10.0, 30))
    y = 1e-4 * x + rng.exponential(1e-3, 30)
    slope, offset = line_below(x, y)
    best = (y - slope * x - offset).sum()
    assert (y - slope * x - offset).min() >= -1e-12  # float64
    for i in range(30):
        for j in range(i):
            other = (y[i] - y[j]) / (x[i] - x[j])
            distance = y - y[i] - other * (x - x[i])
            if distance.min() >= -1e-12 and abs(other) <= 1e-3:
                assert distance.sum() >= best - 1e-12
