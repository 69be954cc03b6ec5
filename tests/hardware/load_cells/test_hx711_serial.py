"""The reader of a load cell's lines, over a bad wire, a restart and an unplugged cable."""

import sys
import time
from types import ModuleType

import pytest

from tendon_hardware.errors import PortBusy, PortUnavailable
from tendon_hardware.load_cells import LOAD_CELLS
from tendon_hardware.load_cells.hx711_gpio import Hx711Gpio
from tendon_hardware.load_cells.hx711_serial import Hx711Serial
from tendon_hardware.virtual_bench import FaultEvent, Faults, LockstepBench, VirtualPorts
from tendon_newton.errors import MissingDependency
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


def test_banners_and_comments_are_no_readings() -> None:
    """The microcontroller says hello; only what begins with # is silent about it."""
    cell, stream, _ = reader()
    stream.pieces = [(0.0, b"\x00\xf8boot\r\n# gain 128\n"), *lines(0, 2)]
    assert len(cell.drain()) == 2
    assert cell.counters.rejected == 1


def test_missing_readings_are_counted() -> None:
    """Two gaps, five readings."""
    cell, stream, _ = reader()
    stream.pieces = [*lines(0, 10), *lines(12, 20), *lines(23, 30)]
    assert len(cell.drain()) == 25
    assert (cell.counters.gaps, cell.counters.lost) == (2, 5)


def test_the_sequence_goes_on_across_its_wrap() -> None:
    """32 bits of sequence and of microseconds wrap without a gap."""
    cell, stream, _ = reader()
    stream.pieces = lines(0, 40, start=2**32 - 20)
    assert len(cell.drain()) == 40
    assert (cell.counters.lost, cell.counters.restarts) == (0, 0)


def test_a_restart_of_the_microcontroller_costs_no_reading() -> None:
    """Sequence and clock begin anew; the first reading waits for one that follows it."""
    cell, stream, _ = reader()
    stream.pieces = [*lines(1000, 1010), *((13.0 + t, data) for t, data in lines(0, 10))]
    assert len(cell.drain()) == 20
    assert (cell.counters.restarts, cell.counters.lost, cell.counters.rejected) == (1, 0, 0)


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
        cell = make("gpio:5,6" if name.endswith("gpio") else "/dev/no_such_port")
        assert cell.name == name
        assert (cell.counters.lines, cell.drain()) == (0, [])
        cell.close()


def test_a_bad_wire_costs_only_the_lines_that_it_breaks() -> None:
    """One line in 50 garbled and one in 50 lost, for a minute: all others arrive, once."""
    bench = LockstepBench("finger", 2, faults=Faults(garbled_lines=0.02, lost_lines=0.02))
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


DATA, CLOCK = 5, 6


class Pins(ModuleType):
    """Stands in for lgpio, with an HX711 at its pins."""

    error = OSError

    def __init__(self, counts: int, *, slow: bool = False) -> None:
        super().__init__("lgpio")
        self.word = counts & 0xFFFFFF
        self.slow = slow
        self.pulses = 0
        self.ready = time.monotonic()
        self.closed = False

    def gpiochip_open(self, chip: int) -> int:
        """Open a chip; there is only the first."""
        if chip:
            raise self.error("can not open gpiochip")
        return chip

    def gpiochip_close(self, chip: int) -> None:
        """Note that it was closed."""
        self.closed = True

    def gpio_claim_input(self, chip: int, pin: int) -> None:
        """Do nothing."""

    def gpio_claim_output(self, chip: int, pin: int, level: int) -> None:
        """Do nothing."""

    def gpio_read(self, chip: int, pin: int) -> int:
        """Return DOUT: the bit that was clocked out, or whether a conversion is not ready."""
        if self.pulses == 0:
            return int(time.monotonic() < self.ready)
        return self.word >> (24 - self.pulses) & 1 if self.pulses <= 24 else 1

    def gpio_write(self, chip: int, pin: int, level: int) -> None:
        """Clock; the 25th pulse begins the next conversion."""
        self.pulses += level
        if level and self.slow:
            time.sleep(1e-4)
        if not level and self.pulses == 25:
            self.pulses = 0
            self.ready = time.monotonic() + 2e-3


def collect(cell: Hx711Gpio, seconds: float) -> list:
    """Collect readings for a time [s]."""
    readings = []
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        time.sleep(0.01)
        readings += cell.drain()
    return readings


def test_without_lgpio_the_package_is_named() -> None:
    """With the command that installs it."""
    with pytest.raises(MissingDependency, match="sudo apt install python3-lgpio"):
        Hx711Gpio(DATA, CLOCK).open()


@pytest.mark.parametrize("word", ["gpio:5", "gpio:5,6,0,1", "gpio:a,b"])
def test_pins_that_are_none_are_refused(word: str) -> None:
    """Two numbers, or three with the chip."""
    with pytest.raises(PortUnavailable, match="as in gpio:5,6"):
        Hx711Gpio.from_pins(word)


def test_a_chip_that_is_not_there_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its number has changed with the kernels."""
    monkeypatch.setitem(sys.modules, "lgpio", Pins(0))
    with pytest.raises(PortUnavailable, match="pins 5 and 6 of gpiochip 4"):
        Hx711Gpio.from_pins("gpio:5,6,4").open()


@pytest.mark.parametrize("counts", [0, 1_234_567, -1, -0x800000])
def test_conversions_are_shifted_out_with_their_sign(
    monkeypatch: pytest.MonkeyPatch, counts: int
) -> None:
    """24 bits, highest first, and one pulse more."""
    pins = Pins(counts)
    monkeypatch.setitem(sys.modules, "lgpio", pins)
    cell = Hx711Gpio(DATA, CLOCK)
    cell.open()
    readings = collect(cell, 0.3)
    cell.close()
    assert readings
    assert {reading.counts for reading in readings} == {counts}
    assert cell.counters.lines >= len(readings)
    assert pins.closed


def test_a_conversion_with_a_slow_pulse_is_thrown_away(monkeypatch: pytest.MonkeyPatch) -> None:
    """100 us of clock high may have put the chip to sleep: nothing after it can be trusted."""
    monkeypatch.setitem(sys.modules, "lgpio", Pins(5, slow=True))
    cell = Hx711Gpio(DATA, CLOCK)
    cell.open()
    readings = collect(cell, 0.2)
    cell.close()
    assert readings == []
    assert cell.counters.rejected > 0
    assert cell.counters.lost == cell.counters.rejected
