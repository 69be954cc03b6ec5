"""Logs of Rhoban/bam: servos that turn a pendulum."""

from pathlib import Path

from tendon_lab.foreign_logs.bam.bam_logs import LogKind, read_logs
from tendon_lab.foreign_logs.bam.motors import MOTORS, XL330
from tendon_newton.data.importers.imported import Imported

ANY_MOTOR = LogKind(title="BAM", motors=MOTORS)
XL330_ALONE = LogKind(title="XL330", motors={"xl330": XL330}, unnamed=XL330)

__all__ = ["read_bam", "read_xl330"]


def read_bam(folder: Path) -> Imported:
    """Read every log of a folder."""
    return read_logs(folder, ANY_MOTOR)


def read_xl330(folder: Path) -> Imported:
    """Read every log of a folder of a DYNAMIXEL XL330-M288-T, and refuse those of other servos."""
    return read_logs(folder, XL330_ALONE)
