"""Rules for the tendon prims of a USD stage."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from tendon_newton.mechanisms.findings import AssetFinding, Severity
from tendon_newton.mechanisms.usd_tendon import authored

MOMENT_ARM_LIMIT = 0.1
"""A moment arm above this [m] is no finger's; millimetres slipped in."""
RATIO_LIMIT = 10.0
"""Metres of tendon per metre of travel above this are no pulley's."""


def joint_tendons(stage: Any, joint: Any) -> list[Any]:
    """Return the tendon prims that act on a joint."""
    return [
        prim
        for prim in _tendons(stage)
        if joint.GetPath() in prim.GetRelationship("mjc:path").GetTargets()
    ]


def tendon_findings(stage: Any) -> Iterator[AssetFinding]:
    """Apply every rule for tendons to a stage."""
    tendons = _tendons(stage)
    if not tendons:
        yield AssetFinding(
            prim="/",
            rule="tendon",
            message="a mechanism needs a tendon; there is no MjcTendon prim",
            remedy="Add a prim of type MjcTendon",
            severity="error",
        )
    for prim in tendons:
        yield from _check_kind(prim)
        yield from _check_path(stage, prim)
        yield from _check_drive(prim)


def _tendons(stage: Any) -> list[Any]:
    return [prim for prim in stage.Traverse() if prim.GetTypeName() == "MjcTendon"]


def _finding(
    prim: Any, rule: str, message: str, remedy: str, severity: Severity = "error"
) -> AssetFinding:
    return AssetFinding(
        prim=str(prim.GetPath()), rule=rule, message=message, remedy=remedy, severity=severity
    )


def _check_kind(prim: Any) -> Iterator[AssetFinding]:
    kind = authored(prim, "mjc:type", "spatial")
    if kind != "fixed":
        yield _finding(
            prim,
            "tendon_type",
            f"only tendons with constant moment arms can be simulated; mjc:type is {kind!r}",
            'Write mjc:type = "fixed" and the moment arms as mjc:path:coef',
        )


def _check_path(stage: Any, prim: Any) -> Iterator[AssetFinding]:
    targets = prim.GetRelationship("mjc:path").GetTargets()
    if not targets:
        yield _finding(prim, "tendon_path", "a tendon acts on joints; its mjc:path is empty",
                       "Point mjc:path to the joints that it closes")  # fmt: skip
    for target in targets:
        joint = stage.GetPrimAtPath(target)
        if not joint or "Joint" not in joint.GetTypeName():
            yield _finding(prim, "tendon_path",
                           f"a tendon acts on joints that exist; {target} is none",
                           "Point mjc:path to the joints that it closes")  # fmt: skip
    coefficients = list(authored(prim, "mjc:path:coef", ()))
    indices = list(authored(prim, "mjc:path:indices", None) or range(len(targets)))
    if len(coefficients) != len(indices):
        yield _finding(prim, "tendon_coef",
                       f"mjc:path:coef needs one moment arm per joint; it has {len(coefficients)} "
                       f"for {len(indices)}", "Write one moment arm per joint")  # fmt: skip
    elif sorted(indices) != list(range(len(targets))):
        yield _finding(prim, "tendon_path", "mjc:path:indices must point to each joint of mjc:path "
                       f"once; it is {indices}",
                       "Leave mjc:path:indices out, or count from 0")  # fmt: skip
    else:
        for index, coefficient in zip(indices, coefficients, strict=True):
            yield from _check_arm(prim, stage.GetPrimAtPath(targets[index]), coefficient)


def _check_arm(prim: Any, joint: Any, arm: float) -> Iterator[AssetFinding]:
    if authored(prim, "tendon:direct", False) or not joint:
        return
    revolute = joint.GetTypeName() == "PhysicsRevoluteJoint"
    limit, unit = (MOMENT_ARM_LIMIT, "m") if revolute else (RATIO_LIMIT, "1")
    if abs(arm) > limit:
        yield _finding(prim, "moment_arm", f"the moment arm about {joint.GetName()} is {arm:g} "
                       f"{unit}; beyond {limit:g} it is no bench's",
                       "Check the unit of mjc:path:coef: metres", "warning")  # fmt: skip
    if not arm > 0.0:
        yield _finding(prim, "moment_arm_sign", "a tendon closes a joint where its moment arm is "
                       f"positive; about {joint.GetName()} it is {arm:g} {unit}",
                       "Turn the sign, unless this tendon is meant to open it",
                       "warning")  # fmt: skip


def _check_drive(prim: Any) -> Iterator[AssetFinding]:
    for name, unit in (("tendon:spoolRadius", "m"), ("tendon:forceLimit", "N")):
        value = authored(prim, name, None)
        if value is None:
            yield _finding(prim, "tendon_drive", f"a tendon prim gives {name}; it is missing, and "
                           "the nominal bench's value is used",
                           f"Write {name} [{unit}]", "warning")  # fmt: skip
        elif not value > 0.0:
            yield _finding(prim, "tendon_drive", f"{name} must be positive; it is {value:g} {unit}",
                           f"Write {name} [{unit}]")  # fmt: skip
