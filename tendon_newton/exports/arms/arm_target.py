"""What every target of an arm's export declares."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from tendon_newton.arms.arm import ArmMotion
from tendon_newton.arms.arm_file import IdentifiedArm
from tendon_newton.data.recording import Array
from tendon_newton.exports.export_target import Coverage


@dataclass(frozen=True, kw_only=True)
class ArmWay:
    """One way of running what was written."""

    coverage: Mapping[str, Coverage]  # What it says of each effect of the catalogue
    # (folder, arm, motion) -> what the encoders report [rad], shape (T, J)
    replay: Callable[[Path, IdentifiedArm, ArmMotion], Array]
    floor: bool  # Whether the tip rests on its floor


@dataclass(frozen=True, kw_only=True)
class ArmTarget:
    """One program that an identified arm can be carried into."""

    write: Callable[[Path, IdentifiedArm], tuple[Path, ...]]
    ways: Mapping[str, ArmWay]
    loading: Callable[[IdentifiedArm], str]  # How a user loads the files, in Markdown
