"""Rules that a USD stage must keep before Newton reads it: units, links, joints.

The rules for tendons are in ``tendon_rules``; those that need the finished mechanism in
``mechanism_rules``.
"""

# The stubs of pxr leave out what its C++ modules define.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from tendon_newton.mechanisms.findings import AssetFinding
from tendon_newton.mechanisms.tendon_rules import joint_tendons, tendon_findings
from tendon_newton.mechanisms.usd_tendon import authored

MASS_RANGE = (1.0e-4, 10.0)
"""Masses that a bench on a table has [kg]; outside, grams or millimetres slipped in."""

JOINT_TYPES = ("PhysicsRevoluteJoint", "PhysicsPrismaticJoint")


def stage_findings(stage: Any) -> list[AssetFinding]:
    """Apply every rule to a stage; one with layers missing is judged by that alone."""
    missing = list(_check_composition(stage))
    if missing:
        return missing
    return [
        *_check_units(stage),
        *_check_links(stage),
        *_check_joints(stage),
        *tendon_findings(stage),
    ]


def _check_units(stage: Any) -> Iterator[AssetFinding]:
    from pxr import UsdGeom, UsdPhysics

    def wrong(rule: str, message: str, remedy: str) -> AssetFinding:
        return AssetFinding(prim="/", rule=rule, message=message, remedy=remedy, severity="error")

    meters = UsdGeom.GetStageMetersPerUnit(stage)
    if meters != 1.0:
        yield wrong("units", f"lengths must be in metres; metersPerUnit is {meters:g}",
                    "Write lengths in metres and metersPerUnit = 1")  # fmt: skip
    kilograms = UsdPhysics.GetStageKilogramsPerUnit(stage)
    if kilograms != 1.0:
        yield wrong("units", f"masses must be in kilograms; kilogramsPerUnit is {kilograms:g}",
                    "Write masses in kilograms and kilogramsPerUnit = 1")  # fmt: skip
    up = UsdGeom.GetStageUpAxis(stage)
    if up != "Z":
        yield wrong("up_axis", f"z must point up; upAxis is {up}",
                    'Turn the asset and write upAxis = "Z"')  # fmt: skip
    if not stage.GetDefaultPrim():
        yield wrong("default_prim", "the layer must name the asset's root; defaultPrim is missing",
                    'Write defaultPrim = "<name of the root prim>"')  # fmt: skip


def _check_composition(stage: Any) -> Iterator[AssetFinding]:
    for error in stage.GetCompositionErrors():
        yield AssetFinding(
            prim="/",
            rule="composition",
            message="every layer must be found; "
            + str(error).strip().splitlines()[0].removesuffix("; skipping."),
            remedy="Put the layer in its place or mend its path",
            severity="error",
        )


def _check_links(stage: Any) -> Iterator[AssetFinding]:
    for prim in stage.Traverse():
        if "PhysicsRigidBodyAPI" in prim.GetAppliedSchemas():
            yield from _check_link(prim)


def _check_link(prim: Any) -> Iterator[AssetFinding]:
    def wrong(rule: str, message: str, remedy: str, severity: Any = "error") -> AssetFinding:
        return AssetFinding(
            prim=str(prim.GetPath()), rule=rule, message=message, remedy=remedy, severity=severity
        )

    mass = float(authored(prim, "physics:mass", 0.0))
    if not mass > 0.0:
        yield wrong("mass", f"a link's mass must be positive; it is {mass:g} kg",
                    "Write physics:mass in kilograms")  # fmt: skip
    elif not MASS_RANGE[0] <= mass <= MASS_RANGE[1]:
        yield wrong("mass", f"a bench's link weighs 0.1 g to 10 kg; this one {mass:g} kg",
                    "Check the unit of physics:mass: kilograms", "warning")  # fmt: skip
    moments = sorted(float(x) for x in authored(prim, "physics:diagonalInertia", (0.0, 0.0, 0.0)))
    if not moments[0] > 0.0:
        yield wrong("inertia", f"principal moments of inertia must be positive; they are {moments}",
                    "Write physics:diagonalInertia in kg m^2")  # fmt: skip
    elif moments[0] + moments[1] < moments[2] * (1.0 - 1e-6):  # float32 slack of a thin rod
        yield wrong("inertia", "no principal moment of inertia may exceed the sum of the others; "
                    f"they are {moments}",
                    "Check physics:diagonalInertia against the link's shape")  # fmt: skip


def _check_joints(stage: Any) -> Iterator[AssetFinding]:
    joints = [prim for prim in stage.Traverse() if prim.GetTypeName() in JOINT_TYPES]
    if not joints:
        yield AssetFinding(
            prim="/",
            rule="joint",
            message="a mechanism needs a revolute or prismatic joint; there is none",
            remedy="Add a PhysicsRevoluteJoint or PhysicsPrismaticJoint",
            severity="error",
        )
    for prim in joints:
        yield from _check_joint_bodies(stage, prim)
        if not any(authored(t, "tendon:direct", False) for t in joint_tendons(stage, prim)):
            yield from _check_limits(prim)
            yield from _check_spring(prim)


def _check_joint_bodies(stage: Any, prim: Any) -> Iterator[AssetFinding]:
    bodies = []
    for name in ("physics:body0", "physics:body1"):
        relationship = prim.GetRelationship(name)
        for target in relationship.GetTargets() if relationship else ():
            body = stage.GetPrimAtPath(target)
            bodies.append(body)
            if not body:
                yield AssetFinding(
                    prim=str(prim.GetPath()),
                    rule="joint_body",
                    message=f"a joint joins prims that exist; {name} is {target}, which does not",
                    remedy=f"Point {name} to a link",
                    severity="error",
                )
    if not any(body and "PhysicsRigidBodyAPI" in body.GetAppliedSchemas() for body in bodies):
        yield AssetFinding(
            prim=str(prim.GetPath()),
            rule="joint_body",
            message="a joint moves a rigid body; this one joins none",
            remedy="Point physics:body1 to a prim with PhysicsRigidBodyAPI",
            severity="error",
        )


def _check_limits(prim: Any) -> Iterator[AssetFinding]:
    lower = authored(prim, "physics:lowerLimit", float("-inf"))
    upper = authored(prim, "physics:upperLimit", float("inf"))
    if lower == float("-inf") or upper == float("inf"):
        message = "a joint that a tendon closes needs both ends of its range; one is missing"
    elif not lower < upper:
        message = f"a range's lower end lies below its upper end; it is [{lower:g}, {upper:g}]"
    else:
        return
    yield AssetFinding(
        prim=str(prim.GetPath()),
        rule="limits",
        message=message,
        remedy="Write physics:lowerLimit and physics:upperLimit, in degrees or metres",
        severity="error",
    )


def _check_spring(prim: Any) -> Iterator[AssetFinding]:
    stiffness = authored(prim, "mjc:stiffness", 0.0)
    if not stiffness > 0.0:
        yield AssetFinding(
            prim=str(prim.GetPath()),
            rule="spring",
            message="a tendon cannot push, so a spring must open the joint; "
            f"its stiffness is {stiffness:g}",
            remedy="Write mjc:stiffness in N m/rad or N/m",
            severity="error" if stiffness < 0.0 else "warning",
        )
        return
    rest = authored(prim, "mjc:springref", None)
    upper = authored(prim, "physics:upperLimit", float("inf"))
    if rest is None or rest >= upper:
        found = "missing" if rest is None else f"{rest:g}, at or past the upper limit {upper:g}"
        yield AssetFinding(
            prim=str(prim.GetPath()),
            rule="springref",
            message=f"a return spring is relaxed where the joint is open; mjc:springref is {found}",
            remedy="Write mjc:springref, in degrees or metres",
            severity="warning",
        )
