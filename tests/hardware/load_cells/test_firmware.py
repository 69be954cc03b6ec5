"""The microcontroller's program, compiled for this computer, before a simulated HX711."""

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from tendon_hardware.load_cells.framing import decode_line

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
