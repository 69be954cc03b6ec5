"""HX711 on the Raspberry Pi's own pins: best effort, for a first look without a microcontroller.

Linux may stop a program between two clock edges. A pulse of more than 50 us makes the HX711 fall
asleep or change its gain. A conversion with a slow pulse is thrown away here and counted as
rejected. The other conversions have been clocked properly, but arrive with gaps.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from typing import Any

from tendon_hardware.clock import MonotonicClock
from tendon_hardware.errors import PortUnavailable
from tendon_hardware.load_cells.framing import WORD
from tendon_hardware.load_cells.load_cell_type import LoadCellCounters, LoadCellReading
from tendon_newton.errors import MissingDependency

PULSE_MAX = 50e-6
"""Longest high of the clock before the chip may fall asleep [s]; HX711 data sheet: 50 us."""
DATA_BITS = 24
GAIN_PULSES = 1
"""One pulse after the data selects channel A at a gain of 128 for the next conversion."""
POLL_PERIOD = 1e-3
"""Pause between looks at the data line [s]; a conversion takes 12.5 ms at 80 per second."""


class Hx711Gpio:
    """Readings of an HX711 on two pins, clocked by a thread.

    Args:
        data_pin: Number of the GPIO at DOUT.
        clock_pin: Number of the GPIO at PD_SCK.
        chip: Number of the GPIO chip: 0 on current kernels of the Pi 5, 4 on early ones.
    """

    name = "hx711_gpio"

    def __init__(self, data_pin: int, clock_pin: int, *, chip: int = 0) -> None:
        self._pins = (data_pin, clock_pin)
        self._chip = chip
        self._clock = MonotonicClock()
        self.counters = LoadCellCounters()
        self._readings: deque[LoadCellReading] = deque()
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None

    @classmethod
    def from_pins(cls, word: str) -> Hx711Gpio:
        """Make one from ``gpio:DATA,CLOCK`` or ``gpio:DATA,CLOCK,CHIP``."""
        try:
            numbers = [int(part) for part in word.removeprefix("gpio:").split(",")]
            data_pin, clock_pin, chip = numbers if len(numbers) == 3 else (*numbers, 0)
            return cls(data_pin, clock_pin, chip=chip)
        except ValueError as error:
            raise PortUnavailable(
                f"pins of a load cell are gpio:DATA,CLOCK, as in gpio:5,6; they are {word!r}"
            ) from error

    def open(self) -> None:
        """Claim the pins and start the thread.

        Raises:
            MissingDependency: lgpio is not installed.
            PortUnavailable: The pins cannot be had.
        """
        try:
            import lgpio as installed  # pyright: ignore[reportMissingImports]
        except ImportError as error:
            raise MissingDependency(
                "a load cell on the Pi's own pins needs the package 'lgpio', which is not "
                "installed; sudo apt install python3-lgpio"
            ) from error
        lgpio: Any = installed
        data_pin, clock_pin = self._pins
        try:
            chip = lgpio.gpiochip_open(self._chip)
            lgpio.gpio_claim_input(chip, data_pin)
            lgpio.gpio_claim_output(chip, clock_pin, 0)
        except lgpio.error as error:
            raise PortUnavailable(
                f"pins {data_pin} and {clock_pin} of gpiochip {self._chip} cannot be had; {error}"
            ) from error
        self._stop.clear()
        self.counters.silent_since = self._clock.now()
        self._thread = threading.Thread(
            target=self._listen, args=(lgpio, chip), name="load cell", daemon=True
        )
        self._thread.start()

    def close(self) -> None:
        """Stop the thread and give the pins back; more than once does no harm."""
        self._stop.set()
        if self._thread is not None:
            self._thread.join()
            self._thread = None

    def drain(self) -> list[LoadCellReading]:
        """Return what has been read since the last call, without waiting."""
        return [self._readings.popleft() for _ in range(len(self._readings))]

    def _listen(self, lgpio: Any, chip: int) -> None:
        sequence = 0
        while not self._stop.is_set():
            if lgpio.gpio_read(chip, self._pins[0]):  # low says that a conversion is ready
                time.sleep(POLL_PERIOD)
                continue
            instant = self._clock.now()
            counts = self._shift_in(lgpio, chip)
            sequence = (sequence + 1) % WORD
            if counts is None:
                self.counters.rejected += 1
                self.counters.gaps += 1
                self.counters.lost += 1
                continue
            reading = LoadCellReading(
                sequence=sequence,
                device_time_us=int(instant * 1e6) % WORD,
                host_time=instant,
                counts=counts,
            )
            self._readings.append(reading)
            self.counters.lines += 1
            self.counters.silent_since = instant
        lgpio.gpiochip_close(chip)

    def _shift_in(self, lgpio: Any, chip: int) -> int | None:
        """Clock one conversion out; ``None`` where a pulse was too long to trust it."""
        data_pin, clock_pin = self._pins
        value, slowest = 0, 0.0
        for _ in range(DATA_BITS + GAIN_PULSES):
            start = time.perf_counter()
            lgpio.gpio_write(chip, clock_pin, 1)
            lgpio.gpio_write(chip, clock_pin, 0)
            slowest = max(slowest, time.perf_counter() - start)
            value = value << 1 | lgpio.gpio_read(chip, data_pin)
        if slowest > PULSE_MAX:
            return None
        value >>= GAIN_PULSES
        return value - (1 << DATA_BITS) if value >> (DATA_BITS - 1) else value
