"""Lines of a load cell in whatever bytes arrive."""

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tendon_hardware.errors import LoadCellSilent
from tendon_hardware.load_cells.clock_fit import fit_clock, line_below, runs, unwrap
from tendon_hardware.load_cells.framing import LONGEST_LINE, Frame, LineSplitter, crc8, decode_line
from tendon_hardware.load_cells.hx711_serial import Hx711Serial
from tendon_hardware.load_cells.load_cell_type import LoadCellReading
from tendon_hardware.virtual_bench import LockstepBench
from tests.hardware.load_cells.streams import encode_frame

frames = st.builds(
    Frame,
    sequence=st.integers(0, 2**32 - 1),
    device_time_us=st.integers(0, 2**32 - 1),
    counts=st.integers(-(2**23), 2**23 - 1),
)


def test_the_checksum_is_the_common_crc_8() -> None:
    """Its check value over the nine digits is that of every catalogue of CRCs."""
    assert crc8(b"123456789") == 0xF4
    assert crc8(b"") == 0


def test_a_line_is_as_the_format_says() -> None:
    """One reading, written out."""
    line = encode_frame(Frame(sequence=7, device_time_us=12_500, counts=-42))
    assert line == b"L,7,12500,-42*%02X\n" % crc8(b"L,7,12500,-42")


@given(frame=frames)
def test_a_line_gives_back_its_reading(frame: Frame) -> None:
    """Every number of the format survives, and fits the longest line."""
    line = encode_frame(frame)
    assert decode_line(line.rstrip(b"\n")) == frame
    assert len(line) <= LONGEST_LINE


@given(frame=frames, position=st.integers(0, 100), bit=st.integers(0, 7))
def test_no_flipped_bit_passes(frame: Frame, position: int, bit: int) -> None:
    """A CRC-8 finds every single flipped bit; the pattern finds the rest."""
    line = bytearray(encode_frame(frame).rstrip(b"\n"))
    line[position % len(line)] ^= 1 << bit
    decoded = decode_line(bytes(line))
    # a flipped bit may turn a hexadecimal digit of the checksum into its lower case
    assert decoded is None or decoded == frame


@given(pieces=st.lists(st.binary(max_size=80), max_size=20))
def test_no_bytes_raise_or_become_a_reading_with_a_wrong_checksum(pieces: list[bytes]) -> None:
    """Whatever comes, in whatever pieces: what is accepted is exactly what its CRC covers."""
    splitter = LineSplitter()
    for piece in pieces:
        for line in splitter.feed(piece):
            frame = decode_line(line)
            if frame is not None:
                assert int(line[-2:], 16) == crc8(line[:-3])


@given(
    soup=st.lists(st.one_of(frames, st.binary(max_size=30).filter(lambda b: b"\n" not in b))),
    cuts=st.lists(st.integers(1, 40), min_size=1),
)
def test_whole_lines_are_found_in_garbage_however_it_is_cut(
    soup: list[Frame | bytes], cuts: list[int]
) -> None:
    """Garbage costs the line that it stands in and no other."""
    stream = b"".join(encode_frame(x) if isinstance(x, Frame) else x + b"\n" for x in soup)
    splitter, found, at, turn = LineSplitter(), [], 0, 0
    while at < len(stream):
        size = cuts[turn % len(cuts)]
        found += [decode_line(line) for line in splitter.feed(stream[at : at + size])]
        at, turn = at + size, turn + 1
    sent = [x for x in soup if isinstance(x, Frame)]
    assert [frame for frame in found if frame in sent] == sent


def test_bytes_without_an_end_of_line_do_not_pile_up() -> None:
    """A stream at another rate may never send one."""
    splitter = LineSplitter()
    for _ in range(1000):
        assert splitter.feed(b"\x80" * 100) == []
    (line,) = splitter.feed(b"\n")
    assert len(line) <= LONGEST_LINE
    frame = Frame(sequence=1, device_time_us=2, counts=3)
    assert [decode_line(x) for x in splitter.feed(encode_frame(frame))] == [frame]


@pytest.mark.parametrize(
    "body", ["L,4294967296,0,0", "L,0,4294967296,0", "L,0,0,8388608", "L,0,0,-8388609", "L,0,0"]
)
def test_numbers_that_no_converter_gives_are_refused(body: str) -> None:
    """Beyond 32 bits of clock or 24 bits of counts, even with a checksum that fits."""
    assert decode_line(b"%s*%02X" % (body.encode(), crc8(body.encode()))) is None


def test_the_checksum_lets_few_random_lines_pass(rng: np.random.Generator) -> None:
    """Of lines with random digits one in 256 passes; hence readings are checked for order too."""
    passed = 0
    for _ in range(20_000):
        a, b, c = rng.integers(0, 10_000, 3)
        passed += decode_line(b"L,%d,%d,%d*%02X" % (a, b, c, rng.integers(0, 256))) is not None
    assert passed == pytest.approx(20_000 / 256, abs=5.0 * np.sqrt(20_000 / 256))  # 5 sigma


ROOT = Path(__file__).resolve().parents[3]
PROGRAM = ROOT / "hardware/tendon_hardware/load_cells/firmware/hx711_usb/hx711_usb.ino"


def test_the_microcontroller_sends_what_the_reader_reads(tmp_path: Path) -> None:
    """Signed counts, a sequence, the time at which each was ready, and a checksum that fits.

    The simulated HX711 fails the program where its clock pulses could be stretched by an interrupt.
    """
    compiler = shutil.which("g++") or shutil.which("clang++")
    if compiler is None:
        pytest.skip("no C++ compiler")
    binary = tmp_path / "firmware"
    subprocess.run(
        [
            compiler,
            "-Wall",
            "-Werror",
            f'-DPROGRAM="{PROGRAM}"',
            "-o",
            binary,
            Path(__file__).with_name("firmware_host.cpp"),
        ],
        check=True,
        timeout=60,
    )
    result = subprocess.run([binary], capture_output=True, timeout=60, check=True)
    banner, *lines = result.stdout.rstrip(b"\n").split(b"\n")
    assert banner == b"# tendon load cell, HX711, gain 128"
    frames = [decode_line(line) for line in lines]
    assert all(frame is not None for frame in frames)
    # four conversions are thrown away until the filter has settled
    assert [f.counts for f in frames if f] == [1_000_000 * k for k in range(1, 9)] + [
        -7_777_216,
        -6_777_216,
        -5_777_216,  # 9 to 11 million, beyond 24 bits
    ]
    assert [f.sequence for f in frames if f] == list(range(11))
    times = np.array([f.device_time_us for f in frames if f], dtype=np.int64)
    steps = np.diff(times) % 2**32
    assert np.all(np.abs(steps - 12_500) < 100)  # 12.4 ms and the time to shift 25 bits out
    assert times[-1] < times[0]  # the clock has wrapped, otherwise this shows nothing


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
