"""An identified arm as USD: joints that count as their servos do, with USD's own drives."""

# The stubs of pxr leave out what its C++ modules define.
# pyright: reportAttributeAccessIssue=false

from math import degrees, isfinite, radians
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from tendon_newton.arms.arm import ArmMotion
from tendon_newton.arms.arm_file import IdentifiedArm
from tendon_newton.data.files.text_file import write_text
from tendon_newton.data.recording import Array
from tendon_newton.exports.arms.arm_target import ArmTarget, ArmWay
from tendon_newton.exports.arms.servo_springs import (
    SPRINGS,
    ServoSpring,
    driven_builder,
    replay_builder,
    servo_springs,
    spring_table,
)
from tendon_newton.exports.mujoco.mjcf_servo import FRICTION_SHAPE, FRICTION_TIME
from tendon_newton.mechanisms.authoring.foreign_plan import quaternion
from tendon_newton.mechanisms.usd.stage_file import open_stage

FILE = "arm.usda"
AXES = {"X": (1.0, 0.0, 0.0), "Y": (0.0, 1.0, 0.0), "Z": (0.0, 0.0, 1.0)}


def write_arm_usd(folder: Path, arm: IdentifiedArm) -> tuple[Path, ...]:
    """Write `arm.usda`, which refers to no other file.

    Raises:
        InvalidOutput: The file cannot be written.
    """
    from pxr import Gf, Usd, UsdPhysics

    mechanism = arm.arm.mechanism
    layer = open_stage(mechanism.asset).Flatten(False)
    stage = Usd.Stage.Open(layer)
    for tendon in mechanism.tendons:  # a servo sits on its joint
        stage.RemovePrim(tendon.prim)
    for spring in servo_springs(arm):
        write_spring(stage.GetPrimAtPath(spring.joint.prim), spring)
    size = float(np.linalg.norm(arm.arm.gravity))
    scenes = [UsdPhysics.Scene(p) for p in stage.Traverse() if p.IsA(UsdPhysics.Scene)]
    root = stage.GetDefaultPrim().GetPath()
    for scene in scenes or [UsdPhysics.Scene.Define(stage, root.AppendChild("gravity"))]:
        scene.CreateGravityDirectionAttr(Gf.Vec3f(*(arm.arm.gravity / size).tolist()))
        scene.CreateGravityMagnitudeAttr(size)
    path = folder / FILE
    write_text(path, layer.ExportToString())
    return (path,)


def write_spring(prim: Any, spring: ServoSpring) -> None:
    """Write a joint's frame, range and drive; USD counts those of a revolute one in degrees."""
    from pxr import Gf, Sdf, UsdPhysics, Vt

    joint = spring.joint
    turns = joint.kind == "revolute"
    per, out = (radians(1.0), degrees) if turns else (1.0, float)
    kinds = Sdf.ValueTypeNames

    def put(name: str, kind: Any, value: Any) -> None:
        prim.CreateAttribute(name, kind, False).Set(value)

    axis = np.array(AXES[str(prim.GetAttribute("physics:axis").Get())])
    frame = Rotation.align_vectors(joint.axis, axis)[0].as_matrix()
    put("physics:localPos0", kinds.Point3f, Gf.Vec3f(*joint.parent_position.tolist()))
    put("physics:localRot0", kinds.Quatf, Gf.Quatf(*quaternion(joint.parent_rotation @ frame)))
    put("physics:localRot1", kinds.Quatf, Gf.Quatf(*quaternion(joint.child_rotation @ frame)))
    if all(isfinite(end) for end in joint.limits):
        put("physics:lowerLimit", kinds.Float, out(joint.limits[0]))
        put("physics:upperLimit", kinds.Float, out(joint.limits[1]))
    put("newton:friction", kinds.Float, spring.friction)
    put("mjc:solimpfriction", kinds.DoubleArray, Vt.DoubleArray(FRICTION_SHAPE))
    put("mjc:solreffriction", kinds.DoubleArray, Vt.DoubleArray((FRICTION_TIME, 1.0)))
    drive = UsdPhysics.DriveAPI.Apply(prim, "angular" if turns else "linear")
    drive.CreateTypeAttr("force")
    drive.CreateStiffnessAttr(per * spring.stiffness)
    drive.CreateDampingAttr(per * spring.damping)
    drive.CreateMaxForceAttr(spring.force_limit)


def replay_arm_usd(folder: Path, arm: IdentifiedArm, motion: ArmMotion) -> Array:
    """Replay a motion as Newton reads the file."""
    builder = driven_builder()
    builder.add_usd(str(folder / FILE), collapse_fixed_joints=True)
    return replay_builder(builder, servo_springs(arm), motion)


LOADING = """Open `arm.usda` in Isaac Sim, Newton (`ModelBuilder.add_usd`) or usdview. Joints,
links, ranges and the tilted base's gravity are in it, and a `PhysicsDriveAPI` for each servo. A
joint counts as its servo is told, so that a command is its drive's target. The encoder says the
offset more. Dry friction holds a joint within its servo's band, where a program reads
`newton:friction`.

"""

USD_ARM = ArmTarget(
    write=write_arm_usd,
    ways={f"{FILE} in Newton": ArmWay(coverage=SPRINGS, replay=replay_arm_usd, floor=False)},
    loading=lambda arm: LOADING + spring_table(arm),
)
