"""Which joint of a USD stage moves which link, and the rules that make it a tree on a base."""

from collections.abc import Iterator
from typing import Any

from tendon_newton.mechanisms.rules.link_rules import is_link
from tendon_newton.mechanisms.rules.rule_findings import AssetFinding, about
from tendon_newton.mechanisms.usd.usd_route import targets_of

# Joints with one degree of freedom, which can carry a moment arm
JOINT_TYPES = ("PhysicsRevoluteJoint", "PhysicsPrismaticJoint")


def all_joints(stage: Any) -> list[Any]:
    """Return the prims of every kind of joint."""
    return [
        prim
        for prim in stage.Traverse()
        if str(prim.GetTypeName()).startswith("Physics")
        and str(prim.GetTypeName()).endswith("Joint")
    ]


def moved_joints(stage: Any) -> list[Any]:
    """Return the joints with a degree of freedom."""
    return [prim for prim in all_joints(stage) if prim.GetTypeName() in JOINT_TYPES]


def ends_of(joint: Any) -> list[str | None]:
    """Return the paths of the link that a joint sits on, and of the one that it moves."""
    return [next(iter(targets_of(joint, f"physics:body{end}")), None) for end in "01"]


def movers(stage: Any) -> dict[str, Any]:
    """Return the joint that moves each link, by the link's path; the first where several do."""
    table: dict[str, Any] = {}
    for joint in all_joints(stage):
        if (link := ends_of(joint)[1]) is not None:
            table.setdefault(link, joint)
    return table


def joints_below(stage: Any, joint: Any) -> list[Any]:
    """Return the joints from one towards the base, itself first; a loop is followed once."""
    table = movers(stage)
    chain = [joint]
    while (below := table.get(ends_of(chain[-1])[0] or "")) is not None and below not in chain:
        chain.append(below)
    return chain


def chain_findings(stage: Any) -> Iterator[AssetFinding]:
    """Apply the rules that make a mechanism a tree on a fixed base."""
    table = movers(stage)
    for joint in all_joints(stage):
        below, link = ends_of(joint)
        if link is None:
            continue
        if link == below:
            yield about(joint, "chain").error(
                f"a joint joins two links; both of its ends are {link}",
                "Point physics:body0 to the link before it",
            )
        elif table[link] != joint:
            yield about(joint, "chain").error(
                f"one joint moves a link; {link} is moved by {table[link].GetPath()} too",
                "Point physics:body1 to its own link",
            )
        elif table.get(ends_of(joints_below(stage, joint)[-1])[0] or "") == joint:
            yield about(joint, "chain").error(
                "a chain of joints ends at the base; this one returns to itself",
                "Point physics:body0 of the first joint to the base",
            )
    for prim in stage.Traverse():
        if is_link(prim) and str(prim.GetPath()) not in table:
            yield about(prim, "chain").error(
                "a joint holds every link; no joint's physics:body1 points to this "
                "one, so it would fall",
                "Add a joint that moves it, or a PhysicsFixedJoint that holds it",
            )
