"""Readers of other people's log formats; one file each, one line in the table."""

from collections.abc import Callable
from pathlib import Path

from tendon_newton.data.importers.imported import Imported
from tendon_newton.data.importers.lerobot import read_lerobot

IMPORTERS: dict[str, Callable[[Path], Imported]] = {"lerobot": read_lerobot}
"""Readers by format; those of single data sets stand in `tendon_lab.foreign_logs`."""
MAPPED = "mapped"  # The format of logs that a mapping file describes
