"""The reader of a load cell's lines, over a bad wire, a restart and an unplugged cable."""

import shutil
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tendon_hardware.errors import LoadCellSilent, PortBusy, PortUnavailable
from tendon_hardware.load_cells import LOAD_CELLS
from tendon_hardware.load_cells.clock_fit import fit_clock, line_below, unwrap
from tendon_hardware.load_cells.framing import LONGEST_LINE, LineSplitter, crc8, decode_line
from tendon_hardware.load_cells.hx711_serial import Hx711Serial
from tendon_hardware.load_cells.load_cell_type import LoadCellReading
from tendon_hardware.virtual_bench import FaultEvent, Faults, LockstepBench, VirtualPorts
from tendon_hardware.virtual_bench.physics.unit import draw_unit
from tests.hardware.load_cells.streams import StillClock, WrittenStream, encode_frame, frame, lines


def reader() -> tuple[Hx711Serial, WrittenStream, StillClock]:
    """Return a cell that reads what the test writes."""
    clock, stream = StillClock(), WrittenStream()
    cell = Hx711Serial(stream, clock=clock)
    cell.open()
    return cell, stream, clock


def test_readings_keep_sequence_both_times_and_counts() -> None:
    """Nothing is converted on the way."""
    cell, stream, _ = reader()
    stream.pieces = lines(5, 8, counts=-70_000)
    first, _, last = cell.drain()
    assert (first.sequence, last.sequence) == (5, 7)
    assert (first.device_time_us, first.host_time) == (62_500, 0.0625)
    assert first.counts == -70_000
    assert cell.drain() == []
    assert cell.counters.silent_since == last.host_time


def test_a_line_is_dated_by_the_piece_that_ends_it() -> None:
    """Split in two, it has arrived with its second half."""
    cell, stream, _ = reader()
    line = encode_frame(frame(3))
    stream.pieces = [(0.1, line[:9]), (0.2, line[9:])]
    (reading,) = cell.drain()
    assert reading.host_time == 0.2


GREETING = (0.0, b"\x00\xf8boot\r\n# gain 128\n")
AFTER = [(13.0 + t, data) for t, data in lines(0, 10)]


@pytest.mark.parametrize(
    ("pieces", "readings", "counted"),
    [
        # the microcontroller says hello; only what begins with # is silent about it
        ([GREETING, *lines(0, 2)], 2, {"rejected": 1}),
        ([*lines(0, 10), *lines(12, 20), *lines(23, 30)], 25, {"gaps": 2, "lost": 5}),
        # 32 bits of sequence and of microseconds wrap without a gap
        (lines(0, 40, start=2**32 - 20), 40, {"lost": 0, "restarts": 0}),
        # sequence and clock begin anew; the first reading waits for one that follows it
        ([*lines(1000, 1010), *AFTER], 20, {"restarts": 1, "lost": 0, "rejected": 0}),
    ],
    ids=["banner", "missing", "wrap", "restart"],
)
def test_what_is_no_reading_or_missing_is_counted(pieces, readings, counted) -> None:
    """All others arrive."""
    cell, stream, _ = reader()
    stream.pieces = pieces
    assert len(cell.drain()) == readings
    assert {name: getattr(cell.counters, name) for name in counted} == counted


@pytest.mark.parametrize("broken", [frame(900_000), frame(3), frame(14, start=2**31)])
def test_a_broken_line_that_passes_its_checksum_is_no_reading(broken) -> None:
    """Its sequence or time contradicts the neighbours'."""
    cell, stream, _ = reader()
    stream.pieces = [*lines(0, 10), (0.125, encode_frame(broken)), *lines(11, 20)]
    assert [reading.sequence for reading in cell.drain()] == [*range(10), *range(11, 20)]
    assert (cell.counters.rejected, cell.counters.gaps, cell.counters.restarts) == (1, 1, 0)


def test_an_unplugged_cell_is_silent_and_comes_back_by_itself() -> None:
    """Draining never raises and never waits; the port is tried again every half second."""
    cell, stream, clock = reader()
    stream.pieces = lines(0, 10)
    assert len(cell.drain()) == 10
    stream.lost = True
    for tick in range(100):
        clock.time = 0.2 + tick * 0.0125
        assert cell.drain() == []
    assert cell.counters.silent_since == pytest.approx(9 * 0.0125)
    stream.lost = False
    clock.time = 5.0
    stream.pieces = lines(400, 410)
    assert len(cell.drain()) == 10
    assert (cell.counters.reconnects, stream.openings, cell.counters.lost) == (1, 2, 390)


def test_saturated_counts_are_flagged() -> None:
    """The ends of 24 bits say "too much", not how much."""
    cell, stream, _ = reader()
    stream.pieces = [*lines(0, 1), *lines(1, 2, counts=0x7FFFFF), *lines(2, 3, counts=-0x800000)]
    assert [reading.saturated for reading in cell.drain()] == [False, True, True]


def test_every_load_cell_in_the_table_has_its_name() -> None:
    """A new entry is made from a word and starts with clean counters."""
    for name, make in LOAD_CELLS.items():
        cell = make("/dev/no_such_port")
        assert cell.name == name
        assert (cell.counters.lines, cell.drain()) == (0, [])
        cell.close()


def test_a_bad_wire_costs_only_the_lines_that_it_breaks() -> None:
    """One line in 50 garbled and one in 50 lost, for a minute: all others arrive, once."""
    bench = LockstepBench(
        draw_unit("finger", 2), faults=Faults(garbled_lines=0.02, lost_lines=0.02)
    )
    cell = Hx711Serial(bench.load_cell_stream(), clock=bench.clock)
    cell.open()
    bench.clock.sleep_until(0.1)
    readings = []
    for tick in range(1, 4800):
        bench.clock.sleep_until(0.1 + tick * 0.0125)
        readings += cell.drain()
    sequences = [reading.sequence for reading in readings]
    assert sequences == sorted(set(sequences))
    sent = sequences[-1] - sequences[0] + 1
    counters = cell.counters
    assert counters.lost == sent - len(readings)
    assert 0.025 < counters.lost / sent < 0.055  # 4 %, by four deviations of 4800 draws
    assert abs(counters.rejected - 0.02 * sent) < 40  # 96 expected, by four deviations


def test_a_cell_on_a_port_is_read_by_a_thread() -> None:
    """Real bytes over a real port: dated when they come, quiet while unplugged, locked."""
    with VirtualPorts("spring_weak", 1) as ports:
        cell = Hx711Serial(ports.load_cell_port)
        cell.open()
        try:
            with pytest.raises(PortBusy):
                Hx711Serial(ports.load_cell_port).open()
            readings = wait_for(cell, 40)
            ports.plan(FaultEvent(name="cell_silence", duration=0.5))
            readings += wait_for(cell, 40)
        finally:
            cell.close()
            cell.close()
        assert cell.drain() == []
    assert cell.counters.gaps >= 1
    times = [reading.host_time for reading in readings]
    assert times == sorted(times)
    assert len(set(times)) > 20  # not all at once


def wait_for(cell: Hx711Serial, count: int) -> list:
    """Collect readings, for ten seconds at most."""
    readings = []
    deadline = time.monotonic() + 10.0
    while len(readings) < count and time.monotonic() < deadline:
        time.sleep(0.01)
        readings += cell.drain()
    assert len(readings) >= count
    return readings


def test_a_cell_that_is_not_there_is_named() -> None:
    """No traceback of pyserial."""
    with pytest.raises(PortUnavailable, match="/dev/no_such_port"):
        Hx711Serial("/dev/no_such_port").open()


frames = st.builds(
    LoadCellReading,
    sequence=st.integers(0, 2**32 - 1),
    device_time_us=st.integers(0, 2**32 - 1),
    host_time=st.just(0.0),
    counts=st.integers(-(2**23), 2**23 - 1),
)


def test_the_checksum_is_the_common_crc_8() -> None:
    """Its check value over the nine digits is that of every catalogue of CRCs."""
    assert crc8(b"123456789") == 0xF4
    assert crc8(b"") == 0


@given(frame=frames)
def test_a_line_gives_back_its_reading(frame: LoadCellReading) -> None:
    """Every number of the format survives, and fits the longest line."""
    line = encode_frame(frame)
    assert decode_line(line.rstrip(b"\n"), 0.0) == frame
    assert len(line) <= LONGEST_LINE


@given(frame=frames, position=st.integers(0, 100), bit=st.integers(0, 7))
def test_no_flipped_bit_passes(frame: LoadCellReading, position: int, bit: int) -> None:
    """A CRC-8 finds every single flipped bit; the pattern finds the rest."""
    line = bytearray(encode_frame(frame).rstrip(b"\n"))
    line[position % len(line)] ^= 1 << bit
    decoded = decode_line(bytes(line), 0.0)
    # a flipped bit may turn a hexadecimal digit of the checksum into its lower case
    assert decoded is None or decoded == frame


@given(pieces=st.lists(st.binary(max_size=80), max_size=20))
def test_no_bytes_raise_or_become_a_reading_with_a_wrong_checksum(pieces: list[bytes]) -> None:
    """Whatever comes, in whatever pieces: what is accepted is exactly what its CRC covers."""
    splitter = LineSplitter()
    for piece in pieces:
        for line in splitter.feed(piece):
            frame = decode_line(line, 0.0)
            if frame is not None:
                assert int(line[-2:], 16) == crc8(line[:-3])


@given(
    soup=st.lists(st.one_of(frames, st.binary(max_size=30).filter(lambda b: b"\n" not in b))),
    cuts=st.lists(st.integers(1, 40), min_size=1),
)
def test_whole_lines_are_found_in_garbage_however_it_is_cut(soup, cuts) -> None:
    """Garbage costs the line that it stands in and no other."""
    stream = b"".join(x + b"\n" if isinstance(x, bytes) else encode_frame(x) for x in soup)
    splitter, found, at, turn = LineSplitter(), [], 0, 0
    while at < len(stream):
        size = cuts[turn % len(cuts)]
        found += [decode_line(line, 0.0) for line in splitter.feed(stream[at : at + size])]
        at, turn = at + size, turn + 1
    sent = [x for x in soup if isinstance(x, LoadCellReading)]
    assert [frame for frame in found if frame in sent] == sent


def test_bytes_without_an_end_of_line_do_not_pile_up() -> None:
    """A stream at another rate may never send one."""
    splitter = LineSplitter()
    for _ in range(1000):
        assert splitter.feed(b"\x80" * 100) == []
    (line,) = splitter.feed(b"\n")
    assert len(line) <= LONGEST_LINE
    frame = LoadCellReading(sequence=1, device_time_us=2, host_time=0.0, counts=3)
    assert [decode_line(x, 0.0) for x in splitter.feed(encode_frame(frame))] == [frame]


@pytest.mark.parametrize(
    "body", ["L,4294967296,0,0", "L,0,4294967296,0", "L,0,0,8388608", "L,0,0,-8388609", "L,0,0"]
)
def test_numbers_that_no_converter_gives_are_refused(body: str) -> None:
    """Beyond 32 bits of clock or 24 bits of counts, even with a checksum that fits."""
    assert decode_line(b"%s*%02X" % (body.encode(), crc8(body.encode())), 0.0) is None


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
    frames = [decode_line(line, 0.0) for line in lines]
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
def test_readings_are_dated_to_a_fifth_of_a_millisecond(rng, error) -> None:
    """A minute at 80 Hz with delays of 0.6 ms in the mean and now and then 8 ms."""
    true = PERIOD * np.arange(4800.0)
    delay = rng.exponential(0.6e-3, true.size) + 8e-3 * (rng.random(true.size) < 0.01)
    readings = readings_of(true, delay, error)
    fit = fit_clock(readings)
    assert np.abs(fit.host_time(readings) - true).max() < 0.2e-3
    assert fit.error == pytest.approx(-error, abs=5e-6)
    assert fit.delay_median == pytest.approx(0.6e-3 * np.log(2.0), abs=0.1e-3)


def test_a_virtual_cell_is_dated_by_its_true_clock() -> None:
    """Through bytes, lines and the driver: the scatter of the transport is gone."""
    bench = LockstepBench(draw_unit("finger", 4))
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
