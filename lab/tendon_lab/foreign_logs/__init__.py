"""Readers of single published sets of logs: further rows of ``import`` that only a clone has."""

from collections.abc import Callable
from pathlib import Path

from tendon_lab.foreign_logs.bam import read_bam, read_parameters, read_xl330
from tendon_lab.foreign_logs.so101 import read_so101
from tendon_newton.data.importers.imported import Imported, ImportedModel

IMPORTERS: dict[str, Callable[[Path], Imported]] = {
    "xl330": read_xl330,
    "so101": read_so101,
    "bam": read_bam,
}
MODEL_IMPORTERS: dict[str, Callable[[Path], ImportedModel]] = {"bam": read_parameters}
"""Readers of other people's parameter files, where a format has such."""
