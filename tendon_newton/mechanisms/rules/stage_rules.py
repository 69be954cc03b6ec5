"""Rules that a USD stage must keep before Newton reads it.

Each part has its own file: single attributes, links, joints, chains, tendons. The rules that need
the finished mechanism are in ``mechanism_rules``.
"""

# The stubs of pxr leave out what its C++ modules define.
# pyright: reportAttributeAccessIssue=false

from collections.abc import Iterator
from typing import Any

from tendon_newton.mechanisms.rules.attribute_rules import attribute_findings
from tendon_newton.mechanisms.rules.chain import chain_findings
from tendon_newton.mechanisms.rules.joint_rules import joint_findings
from tendon_newton.mechanisms.rules.link_rules import link_findings
from tendon_newton.mechanisms.rules.rule_findings import STAGE, AssetFinding, about
from tendon_newton.mechanisms.rules.tendon_rules import tendon_findings
from tendon_newton.mechanisms.usd.usd_route import authored

# Gravity of the bodies that one builds on [m/s^2]; outside, another unit slipped in
GRAVITY_RANGE = (1.0, 30.0)


def stage_findings(stage: Any) -> list[AssetFinding]:
    """Apply every rule to a stage.

    One with layers missing is judged by that alone, and one with attributes of the wrong kind by
    its units and those: the other rules rely on both.
    """
    missing = list(_check_composition(stage))
    if missing:
        return missing
    first = [*_check_units(stage), *attribute_findings(stage)]
    if any(finding.rule == "attribute" for finding in first):
        return first
    return [
        *first,
        *_check_gravity(stage),
        *link_findings(stage),
        *joint_findings(stage),
        *chain_findings(stage),
        *tendon_findings(stage),
    ]


def _check_units(stage: Any) -> Iterator[AssetFinding]:
    from pxr import UsdGeom, UsdPhysics

    for what, unit, key, value in (
        ("lengths", "metres", "metersPerUnit", UsdGeom.GetStageMetersPerUnit(stage)),
        ("masses", "kilograms", "kilogramsPerUnit", UsdPhysics.GetStageKilogramsPerUnit(stage)),
    ):
        if value != 1.0:
            yield about(STAGE, "units").error(
                f"{what} must be in {unit}; {key} is {value:g}",
                f"Write {what} in {unit} and {key} = 1",
            )
    up = UsdGeom.GetStageUpAxis(stage)
    if up != "Z":
        yield about(STAGE, "up_axis").error(
            f"z must point up; upAxis is {up}", 'Turn the asset and write upAxis = "Z"'
        )
    if not stage.GetDefaultPrim():
        yield about(STAGE, "default_prim").error(
            "the layer must name the asset's root; defaultPrim is missing or names no prim",
            'Write defaultPrim = "<name of the root prim>"',
        )


def _check_composition(stage: Any) -> Iterator[AssetFinding]:
    for error in stage.GetCompositionErrors():
        words = " ".join(str(error).split()).removesuffix("; skipping.").rstrip(".: ")
        rule, remedy = "every layer must be found", "Put the layer in its place or mend its path"
        if "ycle" in words:
            rule = "layers must not lead back to themselves"
            remedy = "Take the reference out that closes the circle"
        yield about(STAGE, "composition").error(f"{rule}; {words}", remedy)


def _check_gravity(stage: Any) -> Iterator[AssetFinding]:
    scenes = [prim for prim in stage.Traverse() if prim.GetTypeName() == "PhysicsScene"]
    if not scenes:
        yield about(STAGE, "gravity").warning(
            "an asset says how gravity acts on it; there is no PhysicsScene, "
            "and Newton's default is used",
            "Add a PhysicsScene with gravityDirection and gravityMagnitude",
        )
    for prim in scenes[:1]:
        strength = float(authored(prim, "physics:gravityMagnitude", float("-inf")))
        low, high = GRAVITY_RANGE
        if strength >= 0.0 and not low <= strength <= high:
            yield about(prim, "gravity").warning(
                f"gravity is 9.81 m/s^2 on Earth; it is {strength:g}",
                "Check physics:gravityMagnitude and its unit, m/s^2",
            )
    for prim in scenes[1:]:
        yield about(prim, "gravity").warning(
            f"a mechanism has one PhysicsScene; {scenes[0].GetPath()} is one too",
            "Take one of them out",
        )
