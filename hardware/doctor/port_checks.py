"""Serial ports: there, allowed, free, and quick."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator
from pathlib import Path

from hardware.doctor.observation import Observation
from hardware.serial_ports import LATENCY_TIMERS, holders, latency_timer, lock_fault

LATENCY_MAX = 1
"""Greatest latency timer that leaves time for a loop at 80 Hz [ms]."""
UDEV_RULE = 'ACTION=="add", SUBSYSTEM=="usb-serial", DRIVERS=="ftdi_sio", ATTR{latency_timer}="1"'
LISTED_MAX = 3
"""Processes that are named."""
MEMORY_DEVICES = 1
"""Major number in Linux of /dev/null and its like, which half of all programs have open."""
FTDI = 0x0403
"""Vendor number of the chip in a U2D2."""


def found_ports() -> list[tuple[str, int | None, str]]:
    """Return path, vendor number and description of every serial port on USB."""
    from serial.tools import list_ports

    ports = [(port.device, port.vid, port.description) for port in list_ports.comports()]
    return sorted((path, vendor, text) for path, vendor, text in ports if vendor is not None)


def check_search() -> Iterator[Observation]:
    """List the ports that are there, for a user who has named none."""
    ports = found_ports()
    if not ports:
        yield Observation(
            subject="ports",
            verdict="fix",
            found="no serial port on USB",
            remedy="plug in the servo's adapter; dmesg --follow shows whether the system sees it",
        )
    for path, vendor, text in ports:
        kind = "the servo's adapter, by its chip" if vendor == FTDI else text
        yield Observation(subject="ports", verdict="note", found=f"{path}: {kind}")


def check_port(
    subject: str, port: str, ours: frozenset[int] = frozenset()
) -> Iterator[Observation]:
    """Look at a port without opening it.

    Args:
        subject: Device behind the port.
        port: Path of the port.
        ours: Processes that may have it open.
    """
    if not Path(port).exists():
        yield Observation(
            subject=subject,
            verdict="fix",
            found=f"{port}: no such port",
            remedy="plug it in; ls -l /dev/serial/by-id names what is there",
        )
        return
    device = os.stat(port)  # noqa: PTH116  # a path of a device
    if not stat.S_ISCHR(device.st_mode) or os.major(device.st_rdev) == MEMORY_DEVICES:
        yield Observation(
            subject=subject,
            verdict="fix",
            found=f"{port}: no serial port",
            remedy="name one; tendon-newton doctor lists them",
        )
        return
    if not os.access(port, os.R_OK | os.W_OK):
        yield Observation(
            subject=subject,
            verdict="fix",
            found=f"{port}: this user may not open it",
            remedy="sudo usermod -aG dialout $USER, then log out and in again",
        )
        return
    if (fault := lock_fault(port)) is not None:
        yield Observation(
            subject=subject,
            verdict="fix",
            found=fault,
            remedy="remove it; locks that our programs make now are shared between users",
        )
        return
    others = [(number, name) for number, name in holders(port) if number not in ours]
    if others:
        listed = ", ".join(f"{name} (process {number})" for number, name in others[:LISTED_MAX])
        more = f" and {len(others) - LISTED_MAX} more" if len(others) > LISTED_MAX else ""
        yield Observation(
            subject=subject,
            verdict="fix",
            found=f"{port}: open in {listed}{more}, which takes a part of the answers",
            remedy=f"see what it is: ps -p {others[0][0]}; then end it: kill {others[0][0]}",
        )
    else:
        yield Observation(subject=subject, verdict="good", found=f"{port}: there, allowed and free")


def check_latency(port: str) -> Iterator[Observation]:
    """Look at the latency timer of an FTDI adapter, while the port is open and while it is not."""
    timer = latency_timer(port)
    if timer is None:
        yield Observation(subject="latency timer", verdict="good", found="this port has none")
    elif timer <= LATENCY_MAX:
        yield Observation(subject="latency timer", verdict="good", found=f"{timer} ms")
    else:
        file = LATENCY_TIMERS / Path(os.path.realpath(port)).name / "latency_timer"
        yield Observation(
            subject="latency timer",
            verdict="fix",
            found=f"{timer} ms: every read takes as long, and 80 Hz leaves 12.5 ms",
            remedy=f"now: echo 1 | sudo tee {file}; for good: put {UDEV_RULE} into "
            "/etc/udev/rules.d/99-servo-latency.rules, then sudo udevadm control --reload, and "
            "plug it in again",
        )
