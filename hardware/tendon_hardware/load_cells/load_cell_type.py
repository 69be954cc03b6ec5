"""Types between a load cell and the rest: raw readings, and counts of lost ones."""

from dataclasses import dataclass
from typing import Protocol

SATURATED_COUNTS = (0x7FFFFF, -0x800000)
"""Readings of a 24-bit converter at the ends of its range: they say "too much", not how much."""


@dataclass(frozen=True, kw_only=True, slots=True)
class LoadCellReading:
    """One conversion, as it came; forces are made of it later, with a calibration."""

    sequence: int  # Number of the reading since the microcontroller started
    # Microcontroller's clock at the conversion [us], 32 bits that wrap every 71.6 minutes
    device_time_us: int
    # Arrival on the bench's clock [s]: late by the transport, so not the time of the reading
    host_time: float
    counts: int  # Signed 24-bit value

    @property
    def saturated(self) -> bool:
        """The converter was at an end of its range."""
        return self.counts in SATURATED_COUNTS


@dataclass(kw_only=True, slots=True)
class LoadCellCounters:
    """Counts of the readings of a load cell and of lost ones; they only grow."""

    lines: int = 0  # Readings that were accepted
    rejected: int = 0  # Lines that were no whole reading
    gaps: int = 0  # Places where the sequence jumps
    lost: int = 0  # Readings that are missing there
    restarts: int = 0  # Times that the microcontroller started anew
    reconnects: int = 0  # Times that the port was opened again
    # Arrival of the last reading on the bench's clock [s]; the opening before the first
    silent_since: float | None = None


class LoadCell(Protocol):
    """A load cell that runs by itself and is emptied now and then."""

    name: str  # Key in the table of load cells
    counters: LoadCellCounters  # Counts of readings and of lost ones

    def open(self) -> None:
        """Start to listen.

        Raises:
            PortUnavailable: The port is not there.
            PortBusy: Another process holds it.
        """

    def close(self) -> None:
        """Stop to listen; more than once does no harm."""

    def drain(self) -> list[LoadCellReading]:
        """Return what has come since the last call, at once and without ever waiting."""
        ...
