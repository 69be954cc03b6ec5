"""Logs and parameter files of Rhoban/bam: servos that turn a pendulum, and models of them."""

from pathlib import Path

from tendon_newton.data.importers.bam.logs import LogKind, read_logs
from tendon_newton.data.importers.bam.motors import MOTORS
from tendon_newton.data.importers.bam.parameters import read_parameters
from tendon_newton.data.importers.imported import Imported

KIND = LogKind(title="BAM", motors=MOTORS)

__all__ = ["read_bam", "read_parameters"]


def read_bam(folder: Path) -> Imported:
    """Read every log of a folder."""
    return read_logs(folder, KIND)
