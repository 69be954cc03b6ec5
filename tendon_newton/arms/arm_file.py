"""An identified arm on disk: ``arm.json``, with each servo's model in a folder of its joint."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from tendon_newton.actuators.ideal_position import IdealPosition
from tendon_newton.arms.arm import Arm
from tendon_newton.arms.placement import tipped
from tendon_newton.data.files.checked_table import CheckedTable, read_checked
from tendon_newton.data.model_file import Model, NamedValues, load_model
from tendon_newton.errors import InvalidDiagnosis, InvalidModelFile, listed, shown
from tendon_newton.mechanisms.loading import load_mechanism

ARM_FILE = "arm.json"
# Servo of a joint that was not recorded
STANDING = Model(actuator=NamedValues(name=IdealPosition.name, values={}))
PROMISE = "an identified arm is a JSON file"


@dataclass(frozen=True, kw_only=True)
class IdentifiedArm:
    """An arm, and a model of each of its servos."""

    arm: Arm
    models: tuple[Model, ...]  # In the order of its joints, J


def arm_file(path: Path) -> Path | None:
    """Return the file of an identified arm that a path names; None where it names none."""
    if path.name == ARM_FILE:
        return path
    return path / ARM_FILE if (path / ARM_FILE).is_file() else None


def read_arm(file: Path, asset: str | None = None) -> IdentifiedArm:
    """Read what a diagnosis of an arm found.

    The asset may be given, by name or file, in place of the one that the file states.

    Raises:
        InvalidDiagnosis: The file is broken, or of another arm than the asset.
        TendonNewtonError: The asset or the model of a servo is missing or broken.
    """
    table = read_checked(file, InvalidDiagnosis, PROMISE)
    joints, tilt = table.table("joints"), table.pair("tilt")
    mechanism = load_mechanism(table.word("asset") if asset is None else asset)
    if tuple(joints.values) != mechanism.joint_names:
        raise InvalidDiagnosis(
            f"{file}: joints must be those of {mechanism.asset}, "
            f"{listed(mechanism.joint_names)}; they are {listed(joints.values)}"
        )
    rows = [joints.table(name) for name in mechanism.joint_names]
    arm = Arm(
        mechanism=mechanism,
        sign=np.array([sign_of(row) for row in rows]),
        zero=np.array([row.number("zero") for row in rows]),
        gravity=tipped(mechanism.gravity, np.array(tilt)),
        floor=None if table.values.get("floor") is None else table.number("floor"),
    )
    models = [
        servo_model(file, name) if row.values.get("diagnosed") else STANDING
        for name, row in zip(mechanism.joint_names, rows, strict=True)
    ]
    return IdentifiedArm(arm=arm, models=tuple(models))


def sign_of(row: CheckedTable) -> float:
    """Return which way the servo of a joint counts."""
    sign = row.number("sign")
    return sign if abs(sign) == 1.0 else row.refuse("sign", "1 or -1")


def servo_model(file: Path, joint: str) -> Model:
    """Read the model of a servo of an arm."""
    path = file.parent / joint / "model.toml"
    model = load_model(path)
    if model.actuator.name != IdealPosition.name:
        raise InvalidModelFile(
            f"{path}: servos of an arm have the actuator {IdealPosition.name!r}; it is "
            f"{shown(model.actuator.name)}"
        )
    return model


def without(arm: IdentifiedArm, effect: str) -> IdentifiedArm:
    """Return an arm whose servos lack an effect."""
    models = [
        replace(model, effects=tuple(e for e in model.effects if e.name != effect))
        for model in arm.models
    ]
    return replace(arm, models=tuple(models))
