"""The load cell's stream: format, rate, clock, filter, noise."""

import random

import numpy as np
import pytest

from tendon_hardware.load_cells.framing import LineSplitter, decode_line
from tendon_hardware.virtual_bench.physics.constants import LoadCellConstants
from tendon_hardware.virtual_bench.physics.load_cell import GRAVITY, LoadCellBoard
from tests.hardware.virtual_bench.link import Link


def board(**constants: float) -> LoadCellBoard:
    """Return a quiet board: no noise, no drift, unless asked."""
    quiet = {"noise": 0.0, "wander": 0.0} | constants
    return LoadCellBoard(LoadCellConstants(**quiet), random.Random(1))


def readings(cell: LoadCellBoard, tensions: list[float]) -> tuple[np.ndarray, np.ndarray]:
    """Feed a tension per millisecond; return times [s] and counts."""
    rows = []
    for k, tension in enumerate(tensions):
        line = cell.take(tension, 1e-3 * (k + 1))
        if line:
            frame = decode_line(line.strip())
            assert frame is not None
            rows.append((1e-3 * (k + 1), frame.counts))
    times, counts = np.array(rows).T
    return times, counts


def test_the_stream_is_what_the_reader_expects() -> None:
    """After the banner every line decodes, the sequence has no gap, and 80 come in a second."""
    link = Link()
    splitter = LineSplitter()
    lines = splitter.feed(b"".join(line.data for line in link.bench.cell_lines(10.0)))
    frames = [decode_line(line) for line in lines]
    assert frames[0] is None  # the boot banner
    good = [frame for frame in frames if frame is not None]
    assert len(good) == pytest.approx(800, rel=0.025)  # the chip's oscillator: 2 %
    assert set(np.diff([frame.sequence for frame in good])) == {1}


def test_the_boards_clock_is_its_own() -> None:
    """Its microseconds advance with the arrivals to 100 ppm, with half a millisecond of scatter."""
    link = Link(seed=5)
    rows = [(time, decode_line(data.strip())) for time, data in link.lines(20.0)]
    arrivals = np.array([time for time, frame in rows if frame is not None])
    micros = np.array([frame.device_time_us for _, frame in rows if frame is not None])
    slope = np.polyfit(arrivals, 1e-6 * micros, 1)[0]
    assert slope == pytest.approx(1.0, abs=200e-6)


@pytest.mark.parametrize("rate", [80, 20, 10])
def test_a_rate_is_what_was_asked(rate) -> None:
    """80 and 10 are the chip's own; 20 is a mean of four."""
    assert len(Link(load_cell_rate=rate).lines(10.0)) == pytest.approx(10 * rate, rel=0.03)


def test_a_step_settles_in_four_conversions_and_is_25_ms_late() -> None:
    """After 50 ms the counts are those of the new tension; the ramp's delay is two periods."""
    cell = board()
    scale = LoadCellConstants().counts_per_newton
    times, counts = readings(cell, [0.0] * 100 + [10.0] * 200)
    settled = counts[times > 0.1 + 0.0625]
    assert settled == pytest.approx(10.0 * scale, rel=1e-6)
    times, counts = readings(board(), [0.001 * k for k in range(1000)])
    late = times[-20:] - counts[-20:] / scale
    assert late == pytest.approx(0.025, abs=1.5e-3)  # the tick's millisecond


def test_noise_and_scale_are_the_constants() -> None:
    """Under 1 kg the counts are offset + scale * force, scattered as the constants say."""
    cell = board(noise=0.01, offset=1234.0)
    cell.mass = 1.0
    _, counts = readings(cell, [0.0] * 20_000)
    scale = LoadCellConstants().counts_per_newton
    settled = counts[8:]
    assert settled.mean() == pytest.approx(1234.0 + scale * GRAVITY, abs=0.002 * scale)
    assert settled.std() == pytest.approx(0.01 * scale, rel=0.1)


def test_an_overload_saturates() -> None:
    """50 kg is more than 24 bits: the counts stay at the chip's end."""
    cell = board()
    cell.mass = 50.0
    _, counts = readings(cell, [0.0] * 200)
    assert counts[-1] == 2**23 - 1
