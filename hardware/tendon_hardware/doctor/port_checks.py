"""Serial ports: there, allowed, free, and quick."""

import os
import stat
from collections.abc import Iterator
from difflib import get_close_matches
from pathlib import Path

from tendon_hardware.doctor.observation import Observation, observed
from tendon_hardware.serial_ports import LATENCY_TIMERS, holders, latency_timer, lock_fault
from tendon_hardware.virtual_bench.process import WORD

LATENCY_MAX = 1  # Greatest latency timer that leaves time for a loop at 80 Hz [ms]
UDEV_RULE = 'ACTION=="add", SUBSYSTEM=="usb-serial", DRIVERS=="ftdi_sio", ATTR{latency_timer}="1"'
LISTED_MAX = 3  # Processes that are named
MEMORY_DEVICES = 1
"""Major number in Linux of /dev/null and its like, which half of all programs have open."""
FTDI = 0x0403  # Vendor number of the chip in a U2D2


def check_search() -> Iterator[Observation]:
    """List the serial ports on USB that are there, for a user who has named none."""
    from serial.tools import list_ports

    ports = sorted(port for port in list_ports.comports() if port.vid is not None)
    if not ports:
        yield observed(
            "fix",
            "ports",
            "no serial port on USB",
            "plug in the servo's adapter; dmesg --follow shows whether the system sees it",
        )
    for port in ports:
        kind = "the servo's adapter, by its chip" if port.vid == FTDI else port.description
        yield observed("note", "ports", f"{port.device}: {kind}")


def check_port(subject: str, port: str) -> Observation:
    """Look at a port [path] without opening it; the subject is the device behind it."""
    if (fault := port_fault(port)) is not None:
        return observed("fix", subject, *fault)
    return observed("good", subject, f"{port}: there, allowed and free")


def port_fault(port: str) -> tuple[str, str] | None:
    """Return why a port cannot be used, and what helps; None where it can."""
    if not Path(port).exists():
        virtual = get_close_matches(port.split(":")[0], [WORD])
        remedy = "plug it in; ls -l /dev/serial/by-id names what is there"
        remedy = f"did you mean {WORD}?" if virtual else remedy
        return f"{port}: no such port", remedy
    device = os.stat(port)  # noqa: PTH116  # a path of a device
    if not stat.S_ISCHR(device.st_mode) or os.major(device.st_rdev) == MEMORY_DEVICES:
        return f"{port}: no serial port", "name one; tendon-newton doctor lists them"
    if not os.access(port, os.R_OK | os.W_OK):
        remedy = "sudo usermod -aG dialout $USER, then log out and in again"
        return f"{port}: this user may not open it", remedy
    if (fault := lock_fault(port)) is not None:
        return fault, "remove it; locks that our programs make now are shared between users"
    others = [(number, name) for number, name in holders(port) if not emulates(number)]
    if not others:
        return None
    listed = ", ".join(f"{name} (process {number})" for number, name in others[:LISTED_MAX])
    more = f" and {len(others) - LISTED_MAX} more" if len(others) > LISTED_MAX else ""
    first = others[0][0]
    return (
        f"{port}: open in {listed}{more}, which takes a part of the answers",
        f"see what it is: ps -p {first}; then end it: kill {first}",
    )


def emulates(process: int) -> bool:
    """Tell whether a process is a virtual bench, which has its own ports open, whoever began it."""
    try:
        return b"tendon_hardware.virtual_bench" in Path(f"/proc/{process}/cmdline").read_bytes()
    except OSError:
        return False


def check_latency(port: str) -> Iterator[Observation]:
    """Look at the latency timer of an FTDI adapter, while the port is open and while it is not."""
    timer = latency_timer(port)
    if timer is None:
        yield observed("good", "latency timer", "this port has none")
    elif timer <= LATENCY_MAX:
        yield observed("good", "latency timer", f"{timer} ms")
    else:
        file = LATENCY_TIMERS / Path(os.path.realpath(port)).name / "latency_timer"
        yield observed(
            "fix",
            "latency timer",
            f"{timer} ms: every read takes as long, and 80 Hz leaves 12.5 ms",
            f"now: echo 1 | sudo tee {file}; for good: put {UDEV_RULE} into "
            "/etc/udev/rules.d/99-servo-latency.rules, then sudo udevadm control --reload, and "
            "plug it in again",
        )
