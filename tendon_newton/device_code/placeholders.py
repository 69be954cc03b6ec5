"""Placeholders of the device templates, with the types that a reader and a type checker may assume.

`Specialiser` replaces each of them: `real` by float32 or float64, the vectors by their sizes in the
mechanism at hand.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Generic, TypeVar

import warp as wp

if TYPE_CHECKING:
    Item = TypeVar("Item")

    class DeviceArray(Generic[Item]):
        """An array argument of a kernel; Warp's own stub does not know what an index gives."""

        shape: tuple[int, ...]

        def __getitem__(self, index: Any) -> Item: ...
        def __setitem__(self, index: Any, value: Item) -> None: ...

    DeviceGrid = DeviceArray
    DeviceBlock = DeviceArray
else:
    DeviceArray = wp.array
    DeviceGrid = wp.array2d
    DeviceBlock = wp.array3d


class Placeholder(Any):
    """Stands for a type that only a `Specialiser` knows; a type checker lets it do anything."""


real = Placeholder
"""Scalar of the simulation."""
Vec2 = Placeholder
Vec3 = Placeholder
Mat33 = Placeholder
Jet = Placeholder
"""Value and derivatives by position and velocity of a force [N], torque [N m] or angle [rad]."""
Values = Placeholder
"""An effect's own parameters in the order of its declaration, padded with zeros to three; last, the
two numbers that it may remember."""
MemoryVector = Placeholder
"""What the effects remember, one number per tendon or joint of each that does, shape (S,)."""
JointVector = Placeholder
"""One number per joint, shape (J,)."""
JointMatrix = Placeholder
"""Shape (J, J)."""
PlaneMatrix = Placeholder
"""One vector of the plane of motion per joint, shape (J, 2)."""
SpaceMatrix = Placeholder
"""One vector of space per joint, shape (J, 3)."""
TurnMatrix = Placeholder
"""One rotation of space per joint, shape (3 J, 3)."""
TendonVector = Placeholder
"""One number per tendon, shape (D,)."""
ArmMatrix = Placeholder
"""Moment arms [m] or [1], shape (D, J)."""
RowVector = Placeholder
"""One number per row in which dry friction may hold a tendon, shape (R,): the rows of the spools,
then, where spools have coordinates of their own, those of the strings in their guides."""
RowMatrix = Placeholder
"""Their directions among the coordinates [m] or [1], shape (R, J)."""
ParameterVector = Placeholder
"""The actuator's parameters, then each effect's, shape (P,)."""

JOINTS = 2
"""Number of joints J."""
TENDONS = 1
"""Number of tendons D."""
LINKS = 2
"""Number of the mechanism's own joints; J counts the spools that have a coordinate as well."""
ROWS = 1
"""Number of rows R."""


def struct_type(name: str, fields: dict[str, Any]) -> Any:
    """Make a Warp struct whose field types are known only when a kernel is assembled."""
    return wp.struct(type(name, (), {"__annotations__": fields, "__module__": __name__}))


def bindings(
    joints: int, tendons: int, parameters: int, memories: int, precision: Any
) -> dict[str, Any]:
    """Return what the placeholders stand for, for J joints, D tendons, P parameters, S memories."""
    vector, matrix = wp.types.vector, wp.types.matrix
    return {
        "real": precision,
        "Vec2": vector(length=2, dtype=precision),
        "Vec3": vector(length=3, dtype=precision),
        "Mat33": matrix(shape=(3, 3), dtype=precision),
        "Jet": vector(length=3, dtype=precision),
        "Values": vector(length=5, dtype=precision),
        "MemoryVector": vector(length=max(memories, 1), dtype=precision),
        "JointVector": vector(length=joints, dtype=precision),
        "JointMatrix": matrix(shape=(joints, joints), dtype=precision),
        "PlaneMatrix": matrix(shape=(joints, 2), dtype=precision),
        "SpaceMatrix": matrix(shape=(joints, 3), dtype=precision),
        "TurnMatrix": matrix(shape=(3 * joints, 3), dtype=precision),
        "TendonVector": vector(length=tendons, dtype=precision),
        "ArmMatrix": matrix(shape=(tendons, joints), dtype=precision),
        "ParameterVector": vector(length=max(parameters, 1), dtype=precision),
        "JOINTS": joints,
        "TENDONS": tendons,
    }
