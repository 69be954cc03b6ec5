"""The load cell: sends, at a rate that it keeps, without gaps, and moves a little."""

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from tendon_hardware.clock import Clock
from tendon_hardware.doctor.observation import Observation, observed
from tendon_hardware.load_cells.calibrating import reading_rate
from tendon_hardware.load_cells.clock_fit import READINGS_MIN, fit_clock, runs
from tendon_hardware.load_cells.load_cell_type import LoadCell, LoadCellReading

LISTEN_TIME = 3.0  # Time for which the readings of the cell are collected [s]
SLOW_RATE = 40.0
"""Below, the converter's RATE pin is low: it gives 10 or 80 per second, nothing between [1/s]."""
CLOCK_ERROR_MAX = 200e-6
"""Greatest error of a crystal [1]; the line through the clocks corrects it in any case."""
COMMAND = "tendon-newton calibrate"


def check_load_cell(
    cell: LoadCell, clock: Clock, show: Callable[[str], None]
) -> Iterator[Observation]:
    """Listen to an open load cell, left alone meanwhile."""
    show(f"listening to the load cell for {LISTEN_TIME:g} s")
    readings: list[LoadCellReading] = []
    end = clock.now() + LISTEN_TIME
    while clock.now() < end:
        clock.sleep_until(clock.now() + 0.02)
        readings += cell.drain()
    counters = cell.counters
    if len(readings) < READINGS_MIN:
        yield observed(
            "fix",
            "load cell",
            f"{len(readings)} readings and {counters.rejected} broken lines in {LISTEN_TIME:g} s",
            "see that the microcontroller runs hardware/tendon_hardware/load_cells/firmware "
            "and that nothing else listens, nor are the ports exchanged; broken lines alone mean "
            "another rate or format",
        )
        return
    yield from check_counts(readings)
    yield from check_stream(runs(readings)[-1], counters.lost, counters.rejected)


def check_counts(readings: Sequence[LoadCellReading]) -> Iterator[Observation]:
    """Judge the values themselves."""
    counts = np.array([reading.counts for reading in readings], dtype=np.float64)
    sigma = float(counts.std())
    if any(reading.saturated for reading in readings):
        yield observed(
            "fix",
            "load cell",
            "at the end of its range",
            "look for a broken wire of the bridge; else choose a lower gain",
        )
    elif sigma == 0.0:
        yield observed(
            "fix",
            "load cell",
            f"{counts[0]:.0f} counts, without any noise",
            "a live cell always has some: look at the wires between bridge and converter",
        )
    else:
        yield observed(
            "good", "load cell", f"{counts.mean():.0f} counts, scatter {sigma:.0f} counts"
        )


def check_stream(
    readings: Sequence[LoadCellReading], lost: int, rejected: int
) -> Iterator[Observation]:
    """Judge rate, gaps and the microcontroller's clock."""
    rate = reading_rate(readings)
    slow = rate < SLOW_RATE
    yield observed(
        "note" if slow else "good",
        "load cell rate",
        f"{rate:.1f} per second",
        "tie the converter's RATE pin to its supply for 80 per second",
    )
    broken = lost or rejected > 1  # the first line may have begun before we listened
    yield observed(
        "fix" if broken else "good",
        "load cell gaps",
        f"{lost} readings lost, {rejected} broken lines",
        "look at the USB cable; lines come over no hub with other traffic",
    )
    if len(readings) >= READINGS_MIN:
        fit = fit_clock(readings)
        # transport scatters, so that a short time shows no small error
        wrong = abs(fit.error) > CLOCK_ERROR_MAX + fit.delay_median / LISTEN_TIME
        yield observed(
            "note" if wrong else "good",
            "load cell clock",
            f"{1e6 * fit.error:+.0f} ppm against ours; readings arrive "
            f"{1e3 * fit.delay_median:.1f} ms later than the quickest, at most "
            f"{1e3 * fit.delay_max:.1f} ms",
            "nothing: readings are dated by its clock, corrected",
        )
