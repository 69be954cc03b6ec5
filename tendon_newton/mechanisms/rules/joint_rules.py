"""Rules for joints: what they join, their ranges, and what pushes back: springs, losses, stops."""

# The stubs of pxr leave out what its C++ modules define.
# pyright: reportAttributeAccessIssue=false

from collections.abc import Iterator
from math import inf, isfinite, pi
from typing import Any

from tendon_newton.mechanisms.rules.chain import JOINT_TYPES, all_joints, moved_joints
from tendon_newton.mechanisms.rules.link_rules import is_link
from tendon_newton.mechanisms.rules.rule_findings import STAGE, AssetFinding, about
from tendon_newton.mechanisms.rules.tendon_rules import turned_by_shaft
from tendon_newton.mechanisms.usd.usd_route import stated, targets_of

# What the rules read of a joint, and what counts where it has none
JOINT = {
    "physics:localPos0": (0.0, 0.0, 0.0),
    "physics:localPos1": (0.0, 0.0, 0.0),
    "physics:lowerLimit": -inf,
    "physics:upperLimit": inf,
    "mjc:stiffness": 0.0,
    "mjc:springref": None,
    "newton:damping": 0.0,
    "newton:friction": 0.0,
    "newton:limitStiffness": 0.0,
}
# A range of fewer degrees than a turn has radians was most likely written in radians
SMALL_RANGE = 2.0 * pi
# Two halves of a joint farther apart than this [m] when the asset is drawn do not fit
FRAME_GAP = 1.0e-4


def joint_findings(stage: Any) -> Iterator[AssetFinding]:
    """Apply every rule for joints to a stage."""
    if not moved_joints(stage):
        yield about(STAGE, "joint").error(
            "a mechanism needs a revolute or prismatic joint; there is none",
            "Add a PhysicsRevoluteJoint or PhysicsPrismaticJoint",
        )
    for prim in all_joints(stage):
        if prim.GetTypeName() not in (*JOINT_TYPES, "PhysicsFixedJoint"):
            yield about(prim, "joint_type").error(
                "a mechanism has revolute and prismatic joints, and "
                f"fixed ones that hold; this one is a {prim.GetTypeName()}",
                "Build it from revolute joints, one per axis",
            )
    for prim in moved_joints(stage):
        ends = {end: targets_of(prim, f"physics:body{end}") for end in "01"}
        joint = stated(prim, JOINT)
        yield from _check_bodies(stage, prim, ends)
        yield from _check_frames(stage, prim, ends, joint)
        yield from _check_losses(prim, joint)
        if not turned_by_shaft(stage, prim):
            yield from _check_limits(prim, joint)
            yield from _check_spring(prim, joint)
            yield from _check_stops(prim, joint)


def _check_bodies(stage: Any, prim: Any, ends: dict[str, list[str]]) -> Iterator[AssetFinding]:
    for end, targets in ends.items():
        for target in targets:
            if not stage.GetPrimAtPath(target):
                yield about(prim, "joint_body").error(
                    f"a joint joins prims that exist; physics:body{end} is {target}, which does "
                    "not",
                    f"Point physics:body{end} to a link",
                )
    moved = [stage.GetPrimAtPath(target) for target in ends["1"]]
    if not any(body and is_link(body) for body in moved):
        yield about(prim, "joint_body").error(
            "a joint moves a rigid body; physics:body1 of this one is none",
            "Point physics:body1 to a prim with PhysicsRigidBodyAPI",
        )


def _check_frames(
    stage: Any, prim: Any, ends: dict[str, list[str]], joint: dict[str, Any]
) -> Iterator[AssetFinding]:
    """Compare where the two links put the joint, as the asset is drawn."""
    from pxr import Gf, UsdGeom

    places = []
    for end, targets in ends.items():
        body = stage.GetPrimAtPath(targets[0]) if targets else stage.GetPseudoRoot()
        if not body:
            return
        frame = UsdGeom.XformCache().GetLocalToWorldTransform(body)
        places.append(frame.Transform(Gf.Vec3d(*joint[f"physics:localPos{end}"])))
    gap = (places[0] - places[1]).GetLength()
    if gap > FRAME_GAP:
        yield about(prim, "joint_frame").warning(
            f"both links put the joint in the same place; as drawn they are {gap:.3g} m apart",
            "Check physics:localPos0 and localPos1 [m] against the links' translations",
        )


def _check_limits(prim: Any, joint: dict[str, Any]) -> Iterator[AssetFinding]:
    lower = float(joint["physics:lowerLimit"])
    upper = float(joint["physics:upperLimit"])
    if not (isfinite(lower) and isfinite(upper)):
        message = "a joint that a tendon closes needs both ends of its range; one is missing"
    elif not lower < upper:
        message = f"a range's lower end lies below its upper end; it is [{lower:g}, {upper:g}]"
    elif prim.GetTypeName() == "PhysicsRevoluteJoint" and not SMALL_RANGE < upper - lower <= 360.0:
        yield about(prim, "limits").warning(
            f"a joint that a string closes turns by {SMALL_RANGE:.2g} to 360 degrees; this one by "
            f"{upper - lower:g}",
            "Write physics:lowerLimit and physics:upperLimit in degrees: radians times 57.29578",
        )
        return
    else:
        return
    yield about(prim, "limits").error(
        message, "Write physics:lowerLimit and physics:upperLimit, in degrees or metres"
    )


# Degrees per radian [1]: newton:* attributes of revolute joints are per degree
DEGREES = 180.0 / pi
# Return springs above these are no finger's (0.03-0.05 N m/rad) and no bench's (200-800 N/m)
SPRING_LIMITS = {"PhysicsRevoluteJoint": (5.0, "N m/rad"), "PhysicsPrismaticJoint": (1e5, "N/m")}
# A joint whose damping over stiffness [s] is longer creeps open; fingers take some 10 ms
RETURN_TIME = 0.5
# End stops stiffer than this [N m/rad, N/m] need steps far below a millisecond
STOP_LIMITS = {"PhysicsRevoluteJoint": 1.0e4, "PhysicsPrismaticJoint": 1.0e7}


def _check_losses(prim: Any, joint: dict[str, Any]) -> Iterator[AssetFinding]:
    """Check damping and friction: they take energy and let the spring open the joint."""
    for name in ("newton:damping", "newton:friction"):
        if (value := float(joint[name])) < 0.0:
            yield about(prim, "damping").error(
                f"{name} must be 0 or more; it is {value:g}", f"Write {name} as a positive number"
            )
    stiffness = float(joint["mjc:stiffness"])
    revolute = prim.GetTypeName() == "PhysicsRevoluteJoint"
    damping = float(joint["newton:damping"]) * (DEGREES if revolute else 1.0)
    if stiffness > 0.0 and damping / stiffness > RETURN_TIME:
        yield about(prim, "damping").warning(
            f"against its damping the spring takes "
            f"{damping / stiffness:.3g} s to open the joint; a finger's takes 0.01 s",
            "Check newton:damping: N m s per degree, not per radian",
        )


def _check_spring(prim: Any, joint: dict[str, Any]) -> Iterator[AssetFinding]:
    """Check the return spring: there is one, of a finger's size, relaxed where it is open."""
    stiffness = float(joint["mjc:stiffness"])
    limit, unit = SPRING_LIMITS[prim.GetTypeName()]
    if not stiffness > 0.0:
        yield about(prim, "spring").found(
            "error" if stiffness < 0.0 else "warning",
            "a tendon cannot push, so a spring must open the joint; "
            f"its stiffness is {stiffness:g}",
            "Write mjc:stiffness in N m/rad or N/m",
        )
        return
    if stiffness > limit:
        yield about(prim, "spring").warning(
            f"a return spring of {stiffness:g} {unit} is no bench's; they end at {limit:g}",
            "Check the unit of mjc:stiffness: N m/rad or N/m",
        )
    rest = joint["mjc:springref"]
    upper = float(joint["physics:upperLimit"])
    if rest is None or rest >= upper:
        found = "missing" if rest is None else f"{rest:g}, at or past the upper limit {upper:g}"
        yield about(prim, "springref").warning(
            f"a return spring is relaxed where the joint is open; mjc:springref is {found}",
            "Write mjc:springref, in degrees or metres",
        )


def _check_stops(prim: Any, joint: dict[str, Any]) -> Iterator[AssetFinding]:
    """Check the end stops: they are given and no stiffer than a step can follow."""
    revolute = prim.GetTypeName() == "PhysicsRevoluteJoint"
    unit = "N m/deg" if revolute else "N/m"
    for name, least in (
        ("newton:limitStiffness", "positive"),
        ("newton:limitDamping", "0 or more"),
    ):
        attribute = prim.GetAttribute(name)
        value = attribute.Get() if attribute and attribute.HasAuthoredValue() else None
        if value is None:  # Get() alone would return the schema's own number
            yield about(prim, "stop").warning(
                f"a joint gives {name}; it is missing, and Newton's own "
                "number is too stiff for a light link",
                f"Write {name}, as assets/finger does",
            )
        elif value < 0.0 or (value == 0.0 and least == "positive"):
            yield about(prim, "stop").error(
                f"{name} must be {least}; it is {value:g}", f"Write {name} [{unit}]"
            )
    stiffness = float(joint["newton:limitStiffness"]) * (DEGREES if revolute else 1.0)
    if stiffness > STOP_LIMITS[prim.GetTypeName()]:
        yield about(prim, "stop").warning(
            f"an end stop of {stiffness:g} {unit.replace('deg', 'rad')} "
            "throws a light link back harder than any step can follow",
            f"Check the unit of newton:limitStiffness: {unit}",
        )
