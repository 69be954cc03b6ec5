"""What a number of a LeRobotDataset means, which the dataset does not say.

LeRobot logs joints in degrees or, unless told so, in percent of the range that was measured when
the arm was calibrated: -100 to 100, and 0 to 100 for a gripper, which is in percent always. Only
the calibration file beside the dataset's author turns percent into angles.
Source: huggingface/lerobot, ``motors_bus.py``, ``MotorNormMode``.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import pi
from pathlib import Path

import numpy as np

from tendon_newton.data.files.json_file import read_json
from tendon_newton.data.files.text_file import SIZE_LIMIT, finite_number
from tendon_newton.data.files.values import is_table
from tendon_newton.data.importers.joint_faults import DEGREE, GRIPPER
from tendon_newton.data.recording import Array
from tendon_newton.errors import InvalidParameter, InvalidRecording, listed, shown, unknown_name

UNITS = ("rad", "deg", "percent")
COUNT = 2.0 * pi / 4096.0  # [rad] of the encoders of LeRobot's arms
RADIANS_AT_MOST = 2.0 * pi
"""A joint that never leaves this range is taken to be in radians where no unit is given."""


@dataclass(frozen=True, kw_only=True)
class LeRobotUnits:
    """How to read the joints."""

    unit: str | None = None  # One of `UNITS`; None where it is to be seen from the numbers
    calibration: Path | None = None  # LeRobot's calibration file of the arm, for joints in percent

    def __post_init__(self) -> None:
        if self.unit is not None and self.unit not in UNITS:
            raise unknown_name("unit", self.unit, UNITS)
        if (self.unit == "percent") and self.calibration is None:
            raise InvalidParameter(
                "--unit percent needs --calibration, the arm's calibration file of LeRobot: the "
                "range that 100 percent are"
            )


def sizes_of(units: LeRobotUnits, joints: Mapping[str, Array]) -> dict[str, float]:
    """Return the size of each joint's unit [rad]; joints that cannot be told are left out.

    Raises:
        InvalidParameter: Nothing was said, and the numbers are no radians.
    """
    ranges = {} if units.calibration is None else read_ranges(units.calibration)
    unit = units.unit or guess(joints)
    sizes: dict[str, float] = {}
    for name in joints:
        gripper = GRIPPER in name
        if unit == "rad" and not (gripper and far(joints[name])):
            sizes[name] = 1.0
        elif unit == "deg" and not gripper:
            sizes[name] = DEGREE
        elif name in ranges:
            sizes[name] = ranges[name] / (100.0 if gripper else 200.0)
        elif unit == "percent" and not gripper:
            raise InvalidRecording(
                f"{units.calibration}: must hold the joint {name!r}; it holds {listed(ranges)}"
            )
    return sizes


def angle_sizes(units: LeRobotUnits, joints: Mapping[str, Array]) -> dict[str, float]:
    """Return the size of each joint's unit [rad]; a percent is a degree where nobody says."""
    sizes = dict.fromkeys(joints, DEGREE)
    if units.unit is not None or units.calibration is not None:
        return sizes | sizes_of(units, joints)
    small = [name for name in joints if not far(joints[name])]
    arm = [name for name in joints if GRIPPER not in name]
    return sizes | dict.fromkeys(small, 1.0) if set(arm) <= set(small) else sizes


def far(values: Array) -> bool:
    """Tell whether some number lies beyond a turn in radians."""
    return bool(np.abs(values).max() > RADIANS_AT_MOST)


def guess(joints: Mapping[str, Array]) -> str:
    """Return rad where no number of any joint but a gripper lies beyond a turn."""
    turning = {name: values for name, values in joints.items() if GRIPPER not in name} or joints
    most = {name: float(np.abs(values).max()) for name, values in turning.items()}
    widest = max(most, key=lambda name: most[name])
    if most[widest] > RADIANS_AT_MOST:
        raise InvalidParameter(
            f"a LeRobotDataset does not say its unit: {widest} reaches {most[widest]:.4g}, which "
            "may be degrees or percent of its calibrated range; say --unit deg, or --unit percent "
            "with --calibration FILE"
        )
    return "rad"


def read_ranges(path: Path) -> dict[str, float]:
    """Read the range of each joint of a calibration file [rad]."""
    promise = "a calibration of LeRobot is a JSON file"
    table = read_json(path, InvalidRecording, promise, size_limit=SIZE_LIMIT)
    if not table:
        raise InvalidRecording(f"{path}: {promise} with one table per joint; it has none")
    ranges: dict[str, float] = {}
    for name, row in table.items():
        own = row if is_table(row) else {}
        low, high = (finite_number(own.get(key)) for key in ("range_min", "range_max"))
        if low is None or high is None or not low < high:
            raise InvalidRecording(
                f"{path}: {shown(name)} must have range_min below range_max [counts]; it has "
                f"{shown(row)}"
            )
        ranges[name] = COUNT * (high - low)
    return ranges
