"""Rules for what pushes back in a joint: return spring, damping, friction, end stops."""

from collections.abc import Iterator
from math import pi
from typing import Any

from tendon_newton.mechanisms.rules.rule_findings import AssetFinding, about
from tendon_newton.mechanisms.usd.usd_tendon import authored

# Degrees per radian [1]: newton:* attributes of revolute joints are per degree
DEGREES = 180.0 / pi
# Return springs above these are no finger's (0.03-0.05 N m/rad) and no bench's (200-800 N/m)
SPRING_LIMITS = {"PhysicsRevoluteJoint": (5.0, "N m/rad"), "PhysicsPrismaticJoint": (1e5, "N/m")}
# A joint whose damping over stiffness [s] is longer creeps open; fingers take some 10 ms
RETURN_TIME = 0.5
# End stops stiffer than this [N m/rad, N/m] need steps far below a millisecond
STOP_LIMITS = {"PhysicsRevoluteJoint": 1.0e4, "PhysicsPrismaticJoint": 1.0e7}


def check_losses(prim: Any) -> Iterator[AssetFinding]:
    """Check damping and friction: they take energy and let the spring open the joint."""
    for name in ("newton:damping", "newton:friction"):
        if (value := float(authored(prim, name, 0.0))) < 0.0:
            yield about(prim, "damping").error(
                f"{name} must be 0 or more; it is {value:g}", f"Write {name} as a positive number"
            )
    stiffness = float(authored(prim, "mjc:stiffness", 0.0))
    revolute = prim.GetTypeName() == "PhysicsRevoluteJoint"
    damping = float(authored(prim, "newton:damping", 0.0)) * (DEGREES if revolute else 1.0)
    if stiffness > 0.0 and damping / stiffness > RETURN_TIME:
        yield about(prim, "damping").warning(
            f"against its damping the spring takes "
            f"{damping / stiffness:.3g} s to open the joint; a finger's takes 0.01 s",
            "Check newton:damping: N m s per degree, not per radian",
        )


def check_spring(prim: Any) -> Iterator[AssetFinding]:
    """Check the return spring: there is one, of a finger's size, relaxed where it is open."""
    stiffness = float(authored(prim, "mjc:stiffness", 0.0))
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
    rest = authored(prim, "mjc:springref", None)
    upper = float(authored(prim, "physics:upperLimit", float("inf")))
    if rest is None or rest >= upper:
        found = "missing" if rest is None else f"{rest:g}, at or past the upper limit {upper:g}"
        yield about(prim, "springref").warning(
            f"a return spring is relaxed where the joint is open; mjc:springref is {found}",
            "Write mjc:springref, in degrees or metres",
        )


def check_stops(prim: Any) -> Iterator[AssetFinding]:
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
    stiffness = float(authored(prim, "newton:limitStiffness", 0.0)) * (DEGREES if revolute else 1.0)
    if stiffness > STOP_LIMITS[prim.GetTypeName()]:
        yield about(prim, "stop").warning(
            f"an end stop of {stiffness:g} {unit.replace('deg', 'rad')} "
            "throws a light link back harder than any step can follow",
            f"Check the unit of newton:limitStiffness: {unit}",
        )
