"""Many files of messages read in several processes, since decoding them takes a core for long."""

import logging
import signal
from collections.abc import Callable, Sequence
from functools import partial
from logging.handlers import BufferingHandler
from pathlib import Path
from typing import TypeVar

from tendon_newton.data.recording import Recording

Item = TypeVar("Item")

WORTH_A_PROCESS = 4_000_000
"""Size [bytes] of the files of messages from which further processes pay: they start in a second,
in which one megabyte is decoded."""
MESSAGE_FILES = (".mcap", ".db3")
"""Endings of files that are decoded message by message; a CSV file is read at once."""


def process_count(files: Sequence[Path], jobs: int) -> int:
    """Return in how many processes to read files, at most one for each."""
    heavy = [f for f in files if f.suffix in MESSAGE_FILES and f.is_file()]
    size = sum(f.stat().st_size for f in heavy)
    return max(1, min(jobs, len(heavy))) if size > WORTH_A_PROCESS else 1


def read_all(
    read: Callable[[Item], Recording], items: Sequence[Item], processes: int
) -> list[Recording]:
    """Read recordings in their order; what reading warns of is told here.

    Args:
        read: What reads one, a function of a module.
    """
    if processes == 1:
        return [read(item) for item in items]
    from tendon_newton.scheduler import JobOptions, open_executor

    out: list[Recording] = []
    with open_executor(JobOptions(jobs=processes)) as executor:
        for recording, warnings in executor.map(partial(read_aside, read), items):
            for record in warnings:
                logging.getLogger(record.name).handle(record)
            out.append(recording)
    return out


def read_aside(
    read: Callable[[Item], Recording], item: Item
) -> tuple[Recording, list[logging.LogRecord]]:
    """Read one recording in a process of its own, which Ctrl-C leaves to the first one to end."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    kept = BufferingHandler(1000)
    root = logging.getLogger()
    root.addHandler(kept)
    try:
        return read(item), list(kept.buffer)
    finally:
        root.removeHandler(kept)
