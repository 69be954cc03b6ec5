"""Logs of a Dynamixel XL330-M288-T that turns a pendulum, in the format of Rhoban/bam."""

from collections.abc import Sequence
from pathlib import Path

from tendon_newton.data.importers.bam.logs import LogKind, read_logs, start_model_of
from tendon_newton.data.importers.bam.motors import XL330
from tendon_newton.data.importers.imported import Imported, ImportedLog
from tendon_newton.data.model_file import Model

KIND = LogKind(title="XL330", motors={"xl330": XL330}, unnamed=XL330)


def read_xl330(folder: Path) -> Imported:
    """Read every log of a folder, and refuse those of other servos."""
    return read_logs(folder, KIND)


def duty_per_rad(kp: float) -> float:
    """Duty per position error of the servo's loop [1/rad] for its gain in firmware units."""
    return kp * XL330.duty_per_gain


def start_model(logs: Sequence[ImportedLog]) -> Model:
    """Make the model to start from; the recordings carry their own ``duty_per_rad``."""
    return start_model_of(logs, XL330)
