"""Readers of other people's log formats; one file each, one line in the table."""

from collections.abc import Callable
from pathlib import Path

from tendon_newton.data.importers.bam import read_bam, read_parameters, read_xl330
from tendon_newton.data.importers.imported import Imported, ImportedModel
from tendon_newton.data.importers.lerobot import read_lerobot
from tendon_newton.data.importers.so101 import read_so101

IMPORTERS: dict[str, Callable[[Path], Imported]] = {
    "xl330": read_xl330,
    "so101": read_so101,
    "bam": read_bam,
    "lerobot": read_lerobot,
}
MODEL_IMPORTERS: dict[str, Callable[[Path], ImportedModel]] = {"bam": read_parameters}
"""Readers of other people's parameter files, where a format has such."""
MAPPED = "mapped"
"""The format of logs that a mapping file describes."""
