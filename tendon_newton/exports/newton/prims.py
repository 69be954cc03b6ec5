"""Actuator prims that name our drive for Newton."""

# The stubs of pxr leave out what its C++ modules define.
# pyright: reportAttributeAccessIssue=false

from pathlib import Path

import numpy as np

from tendon_newton.data.files.text_file import write_text
from tendon_newton.exports.mujoco.mjcf_servo import FRICTION_SHAPE
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.usd.stage_file import take_units

ACTUATORS = "actuators"  # Name of the scope under the bench's default prim
LONGEST_STEP = 1.0e-4  # Default step [s]


def write_actuators(
    path: Path, bench: Path, mechanism: Mechanism, joints: dict[str, dict[str, float]]
) -> None:
    """Write a layer above a bench with a prim of our drive for each joint that a tendon drives.

    Numbers of joints that differ are given by path and attribute.

    Raises:
        InvalidOutput: The file cannot be written.
    """
    from pxr import Sdf, Usd, Vt

    stage = Usd.Stage.Open(str(bench))
    layer = Sdf.Layer.CreateAnonymous(".usda")
    layer.subLayerPaths.append(str(bench))
    top = Usd.Stage.Open(layer)
    root = stage.GetDefaultPrim().GetPath()
    for prim in stage.Traverse():
        if prim.GetTypeName() in ("PhysicsRevoluteJoint", "PhysicsPrismaticJoint"):
            own = top.OverridePrim(prim.GetPath())
            shape = own.CreateAttribute("mjc:solimpfriction", Sdf.ValueTypeNames.DoubleArray)
            shape.Set(Vt.DoubleArray(FRICTION_SHAPE))
            for name, value in joints.get(str(prim.GetPath()), {}).items():
                own.CreateAttribute(name, Sdf.ValueTypeNames.Float, False).Set(value)
    for d, tendon in enumerate(mechanism.tendons):
        for j in np.flatnonzero(tendon.moment_arm):
            joint = mechanism.joints[j]
            place = root.AppendPath(f"{ACTUATORS}/{tendon.name}_{joint.name}")
            prim = top.DefinePrim(place, "NewtonActuator")
            # Beside a schema that USD knows, Newton's reader passes over any that it does not know
            schemas = Sdf.TokenListOp()
            schemas.prependedItems = ["TendonDriveAPI"]
            prim.SetMetadata("apiSchemas", schemas)
            prim.CreateRelationship("newton:targets", False).SetTargets([joint.prim])
            for name, value in (("tendon", d), ("joint", int(j))):
                prim.CreateAttribute(f"newton:{name}", Sdf.ValueTypeNames.Int, False).Set(value)
    take_units(layer, stage)
    del top
    layer.subLayerPaths[0] = f"./{bench.name}"
    write_text(path, layer.ExportToString())
