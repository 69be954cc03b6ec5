"""Rules for single attributes: of the right kind, and finite.

USD returns a file's value even where the schema wants another type, and Newton would stop at such a
value with a message of its own. The rules after this one may rely on the kinds.
"""

from collections.abc import Iterator
from math import inf, isfinite
from typing import Any

import numpy as np

from tendon_newton.errors import shown
from tendon_newton.mechanisms.rules.rule_findings import AssetFinding, about

NUMBERS = (
    "physics:mass",
    "physics:gravityMagnitude",
    "physics:lowerLimit",
    "physics:upperLimit",
    "newton:limitStiffness",
    "newton:limitDamping",
    "newton:damping",
    "newton:friction",
    "mjc:stiffness",
    "mjc:springref",
    "tendon:spoolRadius",
    "tendon:forceLimit",
    "tendon:excursionOffset",
    "tendon:contactStiffness",
    "tendon:contactDissipation",
    "tendon:contactFriction",
)
# Attributes that hold several numbers, and how many
LISTS: dict[str, int | None] = {
    "physics:centerOfMass": 3,
    "physics:diagonalInertia": 3,
    "physics:gravityDirection": 3,
    "physics:localPos0": 3,
    "physics:localPos1": 3,
    "mjc:path:coef": None,
    "mjc:path:indices": None,
    "mjc:path:segments": None,
    "mjc:path:divisors": None,
    "mjc:sideSites:indices": None,
}
# Attributes that hold a word, and which words they may
WORDS: dict[str, tuple[str, ...] | None] = {
    "physics:axis": ("X", "Y", "Z"),
    "mjc:type": ("fixed", "spatial"),
    "tendon:servo": None,
}
# Attributes that may be infinite: USD's own value for no limit
UNLIMITED = ("physics:lowerLimit", "physics:upperLimit")


def attribute_findings(stage: Any) -> Iterator[AssetFinding]:
    """Apply the rules to every prim of a stage."""
    for prim in stage.Traverse():
        for attribute in prim.GetAuthoredAttributes():
            name, value = attribute.GetName(), attribute.Get()
            expected = fault(name, value) or schema_fault(attribute.GetTypeName(), value)
            if expected is not None:
                came = shown(value)
                yield about(prim, "attribute").error(
                    f"{name} must be {expected}; it is {came}", f"Write {expected}"
                )


def fault(name: str, value: Any) -> str | None:
    """Return what an attribute should have been; None where it is."""
    if value is None:
        return None
    if name in NUMBERS:
        sound = is_number(value) and (isfinite(value) or (name in UNLIMITED and abs(value) == inf))
        return None if sound else "a finite number"
    if name in LISTS:
        items, count = as_list(value), LISTS[name]
        sound = all(is_number(item) and isfinite(item) for item in items)
        if sound and count in (None, len(items)):
            return None
        return "a list of finite numbers" if count is None else f"{count} finite numbers"
    if name in WORDS:
        words = WORDS[name]
        if isinstance(value, str) and (words is None or value in words):
            return None
        return "a word" if words is None else f"one of {', '.join(words)}"
    if name.startswith("xformOp:"):
        return None if is_finite_place(value) else "finite numbers"
    return "true or false" if name == "tendon:direct" and not isinstance(value, bool) else None


def is_finite_place(value: Any) -> bool:
    """Tell whether a vector, quaternion or matrix is finite; what is none of them is not judged."""
    try:
        parts = [value.GetReal(), *value.GetImaginary()] if hasattr(value, "GetReal") else value
        return bool(np.isfinite(np.array(parts, dtype=np.float64)).all())
    except (TypeError, ValueError):
        return True


def schema_fault(kind: Any, value: Any) -> str | None:
    """Return what USD's own schema wants of an attribute; None where it has it.

    The kind is the attribute's type as the schema gives it, whatever the file wrote.
    """
    if value is None or isinstance(value, type(kind.defaultValue)):
        return None
    return f"of the type {kind}"


def is_number(value: Any) -> bool:
    """Tell whether a value is one number."""
    return isinstance(value, int | float) and not isinstance(value, bool)


def as_list(value: Any) -> list[Any]:
    """Return the items of an array or a vector; one thing that is no number for anything else."""
    try:
        return [] if isinstance(value, str) else list(value)
    except TypeError:
        return [None]
