"""The most memory that a piece of work takes."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

STATUS, CLEAR = Path("/proc/self/status"), Path("/proc/self/clear_refs")


class Peak:
    """How much more than at its start a piece of work had resident at its worst [bytes]."""

    size = 0


def resident(what: str) -> int:
    """Return a figure of this process's memory [bytes]."""
    return int(re.findall(rf"{what}:\s+(\d+) kB", STATUS.read_text())[0]) << 10


@contextmanager
def peak_memory() -> Iterator[Peak]:
    """Watch what is done inside."""
    CLEAR.write_text("5")  # the kernel forgets the peak so far
    before, peak = resident("VmRSS"), Peak()
    try:
        yield peak
    finally:
        peak.size = max(resident("VmHWM") - before, 0)
