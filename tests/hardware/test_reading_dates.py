"""When readings of the load cell were made, told while they come in."""

import numpy as np

from tendon_hardware.load_cells.clock_fit import ReadingDates
from tendon_hardware.load_cells.load_cell_type import LoadCellReading


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
