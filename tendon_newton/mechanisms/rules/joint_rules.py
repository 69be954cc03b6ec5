"""Rules for joints: what they join and where, and their ranges."""

# The stubs of pxr leave out what its C++ modules define.
# pyright: reportAttributeAccessIssue=false

from collections.abc import Iterator
from math import isfinite, pi
from typing import Any

from tendon_newton.mechanisms.rules.chain import (
    JOINT_TYPES,
    all_joints,
    moved_joints,
    relationship_targets,
)
from tendon_newton.mechanisms.rules.link_rules import is_link
from tendon_newton.mechanisms.rules.rule_findings import STAGE, AssetFinding, about
from tendon_newton.mechanisms.rules.spring_rules import check_losses, check_spring, check_stops
from tendon_newton.mechanisms.rules.tendon_rules import joint_tendons
from tendon_newton.mechanisms.usd.usd_tendon import authored

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
        yield from _check_bodies(stage, prim)
        yield from _check_frames(stage, prim)
        yield from check_losses(prim)
        if not any(authored(t, "tendon:direct", False) for t in joint_tendons(stage, prim)):
            yield from _check_limits(prim)
            yield from check_spring(prim)
            yield from check_stops(prim)


def _check_bodies(stage: Any, prim: Any) -> Iterator[AssetFinding]:
    for name in ("physics:body0", "physics:body1"):
        for target in relationship_targets(prim, name):
            if not stage.GetPrimAtPath(target):
                yield about(prim, "joint_body").error(
                    f"a joint joins prims that exist; {name} is {target}, which does not",
                    f"Point {name} to a link",
                )
    moved = [stage.GetPrimAtPath(target) for target in relationship_targets(prim, "physics:body1")]
    if not any(body and is_link(body) for body in moved):
        yield about(prim, "joint_body").error(
            "a joint moves a rigid body; physics:body1 of this one is none",
            "Point physics:body1 to a prim with PhysicsRigidBodyAPI",
        )


def _check_frames(stage: Any, prim: Any) -> Iterator[AssetFinding]:
    """Compare where the two links put the joint, as the asset is drawn."""
    from pxr import Gf, UsdGeom

    places = []
    for end in ("0", "1"):
        targets = relationship_targets(prim, f"physics:body{end}")
        body = stage.GetPrimAtPath(targets[0]) if targets else stage.GetPseudoRoot()
        if not body:
            return
        frame = UsdGeom.XformCache().GetLocalToWorldTransform(body)
        local = authored(prim, f"physics:localPos{end}", (0.0, 0.0, 0.0))
        places.append(frame.Transform(Gf.Vec3d(*local)))
    gap = (places[0] - places[1]).GetLength()
    if gap > FRAME_GAP:
        yield about(prim, "joint_frame").warning(
            f"both links put the joint in the same place; as drawn they are {gap:.3g} m apart",
            "Check physics:localPos0 and localPos1 [m] against the links' translations",
        )


def _check_limits(prim: Any) -> Iterator[AssetFinding]:
    lower = float(authored(prim, "physics:lowerLimit", float("-inf")))
    upper = float(authored(prim, "physics:upperLimit", float("inf")))
    if not (isfinite(lower) and isfinite(upper)):
        message = "a joint that a tendon closes needs both ends of its range; one is missing"
    elif not lower < upper:
        message = f"a range's lower end lies below its upper end; it is [{lower:g}, {upper:g}]"
    elif prim.GetTypeName() == "PhysicsRevoluteJoint" and upper - lower < SMALL_RANGE:
        yield about(prim, "limits").warning(
            f"a range of {upper - lower:g} degrees hardly moves",
            "Write physics:lowerLimit and physics:upperLimit in degrees: radians times 57.29578",
        )
        return
    else:
        return
    yield about(prim, "limits").error(
        message, "Write physics:lowerLimit and physics:upperLimit, in degrees or metres"
    )
