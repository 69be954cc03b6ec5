"""The whole examination, in the order in which one thing needs the other."""

import time
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from tendon_hardware.clock import Clock, MonotonicClock
from tendon_hardware.doctor.load_cell_checks import check_load_cell
from tendon_hardware.doctor.observation import Observation, observed
from tendon_hardware.doctor.port_checks import check_latency, check_port, check_search
from tendon_hardware.doctor.servo_checks import check_servo
from tendon_hardware.errors import HardwareFault
from tendon_hardware.load_cells.byte_stream import ByteStream
from tendon_hardware.load_cells.hx711_serial import Hx711Serial
from tendon_hardware.servos import find_servo
from tendon_hardware.servos.serial_bus.servo_port import PortHandler
from tendon_hardware.virtual_bench import lockstep_of
from tendon_hardware.virtual_bench.process import WORD

TICK = 0.0125  # Period of a loop at 80 Hz [s]
TICKS = 80
LATENESS_MAX = 1e-3  # Lateness of one tick in a hundred that a recording should not exceed [s]
BUSY = 0.5 * TICK  # Lateness at which this computer is too busy for a loop at 80 Hz [s]


def ports_of(
    port: str | None, load_cell_port: str | None, servo: str
) -> tuple[Clock, str | PortHandler | None, str | ByteStream | None]:
    """Return clock and ports to examine; the word for a virtual bench brings its own."""
    if port is None or port.split(":")[0] != WORD:
        return MonotonicClock(), port, load_cell_port
    twin = lockstep_of(port, find_servo(servo).name)
    return twin.clock, twin.servo_port(), twin.load_cell_stream()


def examine(
    port: str | PortHandler | None,
    load_cell_port: str | ByteStream | None,
    *,
    clock: Clock,
    show: Callable[[str], None] = lambda _: None,
) -> Iterator[Observation]:
    """Examine a bench, yielding each thing as it is known; no motor moves.

    Args:
        port: Path of the servo's port, or a simulated one; without it the ports are listed.
        load_cell_port: Path of the load cell's port, or its stream, if there is one.
    """
    show("timing the clock")
    late = lateness(clock)
    yield check_waiting(late)
    if port is None:
        yield from check_search()
    else:
        busy = slowest(late) > LATENESS_MAX
        yield from guarded("servo port", check_servo_port(port, clock, show, busy=busy))
    if load_cell_port is not None:
        yield from guarded("load cell port", check_cell_port(load_cell_port, clock, show))


def check_servo_port(
    port: str | PortHandler, clock: Clock, show: Callable[[str], None], *, busy: bool = False
) -> Iterator[Observation]:
    """Look at the servo's port, and through it; a simulated one is looked through alone."""
    if not isinstance(port, str):
        yield from check_servo(port, clock, show)
        return
    seen = check_port("servo port", port)
    yield seen
    if seen.verdict == "fix":
        return
    yield from check_servo(port, clock, show, busy=busy)
    yield from check_latency(port)  # after the driver has asked the adapter to be quick


def check_cell_port(
    port: str | ByteStream, clock: Clock, show: Callable[[str], None]
) -> Iterator[Observation]:
    """Look at the load cell's port, and listen to it."""
    if isinstance(port, str):
        seen = check_port("load cell port", port)
        yield seen
        if seen.verdict == "fix":
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
        yield observed("fix", subject, str(fault), "mend this, and start again")


def lateness(clock: Clock) -> list[float]:
    """Wait for a second of ticks and return how late each comes [s]."""
    late: list[float] = []
    start = clock.now()
    for tick in range(1, TICKS + 1):
        clock.sleep_until(start + tick * TICK)
        late.append(clock.now() - start - tick * TICK)
    return late


def slowest(late: Sequence[float]) -> float:
    """Return what one tick in a hundred exceeds [s]."""
    return float(np.quantile(late, 0.99))


def check_waiting(late: Sequence[float]) -> Observation:
    """Judge how late this computer wakes from a wait [s]."""
    slow = slowest(late)
    resolution = time.get_clock_info("monotonic").resolution
    calm = "end what else runs on this computer, the desktop before all"
    remedy = calm if slow <= BUSY else f"too busy for a loop at 80 Hz: {calm}, and examine again"
    return observed(
        "good" if slow <= LATENESS_MAX else "note" if slow <= BUSY else "fix",
        "clock",
        f"resolution {1e9 * resolution:.0f} ns; wakes {1e3 * float(np.median(late)):.2f} ms "
        f"late, one time in a hundred {1e3 * slow:.2f} ms",
        remedy,
    )
