"""Rules for the tendon prims of a USD stage."""

from collections.abc import Iterator
from typing import Any

from tendon_newton.mechanisms.rules.chain import JOINT_TYPES, joints_below
from tendon_newton.mechanisms.rules.route_rules import route_findings
from tendon_newton.mechanisms.rules.rule_findings import STAGE, AssetFinding, about
from tendon_newton.mechanisms.usd.usd_route import authored, is_routed, targets_of
from tendon_newton.mechanisms.usd.usd_tendon import tendon_arms

MOMENT_ARM_LIMIT = 0.1  # A moment arm above this [m] is no finger's; millimetres slipped in
# What drives a tendon: attribute, unit, and the most on a bench on a table
DRIVE = (("tendon:spoolRadius", "m", 0.1), ("tendon:forceLimit", "N", 1000.0))
RATIO_LIMIT = 10.0  # Metres of tendon per metre of travel above this are no pulley's


def joint_tendons(stage: Any, joint: Any) -> list[Any]:
    """Return the tendon prims that act on a joint."""
    path = str(joint.GetPath())
    return [prim for prim in _tendons(stage) if path in targets_of(prim, "mjc:path")]


def turned_by_shaft(stage: Any, joint: Any) -> bool:
    """Tell whether a tendon that acts on a joint is a shaft, which pulls no string."""
    return any(authored(prim, "tendon:direct", False) for prim in joint_tendons(stage, joint))


def tendon_findings(stage: Any) -> Iterator[AssetFinding]:
    """Apply every rule for tendons to a stage."""
    tendons = _tendons(stage)
    if not tendons:
        yield about(STAGE, "tendon").error(
            "a mechanism needs a tendon; there is no MjcTendon prim", "Add a prim of type MjcTendon"
        )
    for prim in tendons:
        yield from route_findings(stage, prim) if is_routed(prim) else _check_path(stage, prim)
        yield from _check_drive(prim)


def _tendons(stage: Any) -> list[Any]:
    return [prim for prim in stage.Traverse() if prim.GetTypeName() == "MjcTendon"]


def _check_path(stage: Any, prim: Any) -> Iterator[AssetFinding]:
    targets = targets_of(prim, "mjc:path")
    if not targets:
        yield about(prim, "tendon_path").error(
            "a tendon acts on joints; its mjc:path is empty",
            "Point mjc:path to the joints that it closes",
        )
    joints = [stage.GetPrimAtPath(target) for target in targets]
    for target, joint in zip(targets, joints, strict=True):
        if not joint or joint.GetTypeName() not in JOINT_TYPES:
            yield about(prim, "tendon_path").error(
                f"a tendon acts on joints that exist; {target} is none that moves",
                "Point mjc:path to the joints that it closes",
            )
            return
    coefficients = list(authored(prim, "mjc:path:coef", ()))
    indices = list(authored(prim, "mjc:path:indices", None) or range(len(targets)))
    if len(coefficients) != len(indices):
        yield about(prim, "tendon_coef").error(
            f"mjc:path:coef needs one moment arm per joint; it has {len(coefficients)} "
            f"for {len(indices)}",
            "Write one moment arm per joint",
        )
    elif sorted(indices) != list(range(len(targets))):
        yield about(prim, "tendon_path").error(
            f"mjc:path:indices must point to each joint of mjc:path once; it is {indices}",
            "Leave mjc:path:indices out, or count from 0",
        )
    else:
        for index, coefficient in zip(indices, coefficients, strict=True):
            others = [other for other in joint_tendons(stage, joints[index]) if other != prim]
            closed = any(dict(tendon_arms(o)).get(targets[index], 0.0) > 0.0 for o in others)
            yield from _check_arm(prim, joints[index], coefficient, closed=closed)
        yield from _check_connection(stage, prim, joints)


def _check_connection(stage: Any, prim: Any, joints: list[Any]) -> Iterator[AssetFinding]:
    """A string runs along one chain; it cannot leave out a joint in between."""
    farthest = max((joints_below(stage, joint) for joint in joints), key=len, default=[])
    apart = [joint for joint in joints if joint not in farthest]
    for joint in apart:
        yield about(prim, "tendon_path").warning(
            "a tendon runs along one chain of joints; "
            f"{joint.GetPath()} is not on the way from {farthest[0].GetPath()} to the "
            "base",
            "Give each chain its own tendon",
        )
    places = [farthest.index(joint) for joint in joints if joint in farthest]
    between = farthest[min(places) : max(places)] if places else []
    for joint in between:
        if joint not in joints and joint.GetTypeName() in JOINT_TYPES:
            yield about(prim, "tendon_path").warning(
                f"a tendon that passes {joint.GetPath()} has a "
                "moment arm there; its mjc:path leaves it out",
                "Add the joint to mjc:path, with arm 0 if the string runs through its axis",
            )


def _check_arm(prim: Any, joint: Any, arm: float, *, closed: bool) -> Iterator[AssetFinding]:
    """Check one moment arm; a joint that another tendon closes may be opened by this one."""
    if authored(prim, "tendon:direct", False):
        return
    revolute = joint.GetTypeName() == "PhysicsRevoluteJoint"
    limit, unit = (MOMENT_ARM_LIMIT, "m") if revolute else (RATIO_LIMIT, "1")
    if abs(arm) > limit:
        yield about(prim, "moment_arm").warning(
            f"the moment arm about {joint.GetName()} is {arm:g} "
            f"{unit}; beyond {limit:g} it is no bench's",
            "Check the unit of mjc:path:coef: metres",
        )
    if not (arm > 0.0 or (arm < 0.0 and closed)):
        yield about(prim, "moment_arm_sign").warning(
            "a tendon closes a joint where its moment arm is "
            f"positive; about {joint.GetName()} it is {arm:g} {unit}",
            "Turn the sign, unless this tendon is meant to open it",
        )


def _check_drive(prim: Any) -> Iterator[AssetFinding]:
    for name, unit, most in DRIVE:
        value = authored(prim, name, None)
        if value is None:
            yield about(prim, "tendon_drive").warning(
                f"a tendon prim gives {name}; it is missing, and the nominal bench's value is used",
                f"Write {name} [{unit}]",
            )
        elif not value > 0.0:
            yield about(prim, "tendon_drive").error(
                f"{name} must be positive; it is {value:g} {unit}", f"Write {name} [{unit}]"
            )
        elif value > most and not authored(prim, "tendon:direct", False):
            yield about(prim, "tendon_drive").warning(
                f"{name} of a bench on a table is at most {most:g} {unit}; it is {value:g} {unit}",
                f"Check its unit: {unit}",
            )
