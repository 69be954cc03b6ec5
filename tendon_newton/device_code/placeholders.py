"""Placeholders of the device templates, with the types that a reader and a type checker may assume.

`Specialiser` replaces each of them: `real` by float32 or float64, the vectors by their sizes in the mechanism at hand.
"""

from __future__ import annotations

from typing import Any

import warp as wp

real = wp.float64
"""Scalar of the simulation."""
Vec2 = wp.vec2d
Vec3 = wp.vec3d
Mat33 = wp.mat33d
Jet = wp.vec3d
"""(value, derivative by position, derivative by velocity) of a force [N], a torque [N m] or an angle [rad]."""
Values = wp.vec3d
"""An effect's own parameters in the order of its declaration, padded with zeros."""
JointVector = wp.vec2d
"""One number per joint, shape (J,)."""
JointMatrix = wp.mat22d
"""Shape (J, J)."""
PlaneMatrix = wp.mat22d
"""One vector of the plane of motion per joint, shape (J, 2)."""
SpaceMatrix = wp.types.matrix(shape=(2, 3), dtype=wp.float64)
"""One vector of space per joint, shape (J, 3)."""
TendonVector = wp.types.vector(length=1, dtype=wp.float64)
"""One number per tendon, shape (D,)."""
ArmMatrix = wp.types.matrix(shape=(1, 2), dtype=wp.float64)
"""Moment arms [m] or [1], shape (D, J)."""
ParameterVector = wp.types.vector(length=8, dtype=wp.float64)
"""The actuator's parameters, then each effect's, shape (P,)."""

JOINTS = 2
"""Number of joints J."""
TENDONS = 1
"""Number of tendons D."""


def struct_type(name: str, fields: dict[str, Any]) -> Any:
    """Make a Warp struct whose field types are known only when a kernel is assembled."""
    return wp.struct(type(name, (), {"__annotations__": fields, "__module__": __name__}))


def bindings(joints: int, tendons: int, parameters: int, precision: Any) -> dict[str, Any]:
    """Return what each placeholder stands for in a kernel of J joints, D tendons and P parameters."""
    vector, matrix = wp.types.vector, wp.types.matrix
    return {
        "real": precision,
        "Vec2": vector(length=2, dtype=precision),
        "Vec3": vector(length=3, dtype=precision),
        "Mat33": matrix(shape=(3, 3), dtype=precision),
        "Jet": vector(length=3, dtype=precision),
        "Values": vector(length=3, dtype=precision),
        "JointVector": vector(length=joints, dtype=precision),
        "JointMatrix": matrix(shape=(joints, joints), dtype=precision),
        "PlaneMatrix": matrix(shape=(joints, 2), dtype=precision),
        "SpaceMatrix": matrix(shape=(joints, 3), dtype=precision),
        "TendonVector": vector(length=tendons, dtype=precision),
        "ArmMatrix": matrix(shape=(tendons, joints), dtype=precision),
        "ParameterVector": vector(length=max(parameters, 1), dtype=precision),
        "JOINTS": joints,
        "TENDONS": tendons,
    }
