"""Readers of other people's log formats; one file each, one line in the table."""

from collections.abc import Callable
from pathlib import Path

from tendon_newton.data.importers.imported import Imported
from tendon_newton.data.importers.so101 import read_so101
from tendon_newton.data.importers.xl330 import read_xl330

IMPORTERS: dict[str, Callable[[Path], Imported]] = {
    "xl330": read_xl330,
    "so101": read_so101,
}
MAPPED = "mapped"
"""The format of logs that a mapping file describes."""
