"""The load cell on the Pi's own pins, with a stand-in for the pins."""

import sys
import time
from types import ModuleType

import pytest

from tendon_hardware.errors import PortUnavailable
from tendon_hardware.load_cells.hx711_gpio import Hx711Gpio
from tendon_newton.errors import MissingDependency

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
