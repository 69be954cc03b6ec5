"""The whole examination, in the order in which one thing needs the other."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator

import numpy as np

from hardware.clock import Clock
from hardware.doctor.load_cell_checks import check_load_cell
from hardware.doctor.observation import Observation
from hardware.doctor.port_checks import check_latency, check_port, check_search
from hardware.doctor.servo_checks import check_servo
from hardware.errors import HardwareFault
from hardware.load_cells.hx711_serial import Hx711Serial

TICK = 0.0125
"""Period of a loop at 80 Hz [s]."""
TICKS = 80
LATENESS_MAX = 1e-3
"""Lateness of one tick in a hundred that a recording should not exceed [s]."""


def examine(
    port: str | None,
    load_cell_port: str | None,
    *,
    clock: Clock,
    ours: frozenset[int] = frozenset(),
    show: Callable[[str], None] = lambda _: None,
) -> Iterator[Observation]:
    """Examine a bench, yielding each thing as it is known; no motor moves.

    Args:
        port: Path of the servo's port; without it the ports are listed.
        load_cell_port: Path of the load cell's port, if there is one.
        clock: The bench's clock.
        ours: Processes that may have the ports open.
        show: Told what takes time.
    """
    yield check_waiting(clock, show)
    if port is None:
        yield from check_search()
    else:
        yield from guarded("servo port", check_servo_port(port, clock, ours, show))
    if load_cell_port is not None:
        yield from guarded("load cell port", check_cell_port(load_cell_port, clock, ours, show))


def check_servo_port(
    port: str, clock: Clock, ours: frozenset[int], show: Callable[[str], None]
) -> Iterator[Observation]:
    """Look at the servo's port, and through it."""
    observations = list(check_port("servo port", port, ours))
    yield from observations
    if any(observation.verdict == "fix" for observation in observations):
        return
    yield from check_servo(port, clock, show)
    yield from check_latency(port)  # after the driver has asked the adapter to be quick


def check_cell_port(
    port: str, clock: Clock, ours: frozenset[int], show: Callable[[str], None]
) -> Iterator[Observation]:
    """Look at the load cell's port, and listen to it."""
    observations = list(check_port("load cell port", port, ours))
    yield from observations
    if any(observation.verdict == "fix" for observation in observations):
        return
    cell = Hx711Serial(port, clock=clock)
    cell.open()
    try:
        yield from check_load_cell(cell, clock, show)
    finally:
        cell.close()


def guarded(subject: str, observations: Iterator[Observation]) -> Iterator[Observation]:
    """Turn an error into one more thing that was seen."""
    try:
        yield from observations
    except HardwareFault as fault:
        yield Observation(
            subject=subject, verdict="fix", found=str(fault), remedy="mend this, and start again"
        )


def check_waiting(clock: Clock, show: Callable[[str], None]) -> Observation:
    """Measure how late this computer wakes from a wait."""
    show("timing the clock")
    late = []
    start = clock.now()
    for tick in range(1, TICKS + 1):
        clock.sleep_until(start + tick * TICK)
        late.append(clock.now() - start - tick * TICK)
    slow = float(np.quantile(late, 0.99))
    good = slow <= LATENESS_MAX
    resolution = time.get_clock_info("monotonic").resolution
    return Observation(
        subject="clock",
        verdict="good" if good else "note",
        found=f"resolution {1e9 * resolution:.0f} ns; wakes {1e3 * float(np.median(late)):.2f} ms "
        f"late, one time in a hundred {1e3 * slow:.2f} ms",
        remedy="" if good else "end what else runs on this computer, the desktop before all",
    )
