"""An identified arm as URDF: joints that count as their servos do, and what holds them in passing.

URDF has no servo: a program gives each joint a drive of the stiffness that the page lists.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from tendon_newton.arms.arm import ArmMotion
from tendon_newton.arms.arm_file import IdentifiedArm
from tendon_newton.data.files.text_file import write_text
from tendon_newton.data.recording import Array
from tendon_newton.exports.arms.arm_target import ArmTarget, ArmWay
from tendon_newton.exports.arms.replaying import angles_of
from tendon_newton.exports.arms.servo_springs import (
    SPRINGS,
    driven_builder,
    replay_builder,
    servo_springs,
    spring_table,
)
from tendon_newton.exports.mujoco.mjcf_servo import set_affine
from tendon_newton.exports.urdf_target import robot_text
from tendon_newton.mechanisms.authoring.mujoco_file import TIME_STEP, newton_s_mujoco
from tendon_newton.mechanisms.geometry.joints import Joint

FILE = "arm.urdf"
DOWN = np.array([0.0, 0.0, -1.0])


def write_arm_urdf(folder: Path, arm: IdentifiedArm) -> tuple[Path, ...]:
    """Write `arm.urdf`, whose base stands so that gravity points along -z.

    Raises:
        InvalidOutput: The file cannot be written.
    """
    upright = Rotation.align_vectors(DOWN, arm.arm.gravity)[0].as_matrix()
    joints, springs = [], servo_springs(arm)
    for spring in springs:
        joint = spring.joint
        joints.append(
            replace(
                upon(joint, upright) if joint.parent < 0 else joint,
                damping=joint.damping + spring.damping,
                friction=spring.friction,
            )
        )
    path = folder / FILE
    limits = [spring.force_limit for spring in springs]
    write_text(path, robot_text(arm.arm.mechanism.name, joints, limits))
    return (path,)


def upon(joint: Joint, turn: Array) -> Joint:
    """Return a joint of the base where that is turned, by a rotation matrix (3, 3)."""
    return replace(
        joint,
        parent_position=turn @ joint.parent_position,
        parent_rotation=turn @ joint.parent_rotation,
    )


def replay_in_mujoco(folder: Path, arm: IdentifiedArm, motion: ArmMotion) -> Array:
    """Replay a motion as MuJoCo reads the file, with a drive on each joint."""
    mujoco = newton_s_mujoco()
    spec = mujoco.MjSpec.from_file(str(folder / FILE))
    spec.option.timestep = TIME_STEP
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    springs = servo_springs(arm)
    for spring in springs:
        name = spring.joint.name
        drive = spec.add_actuator(name=name, trntype=mujoco.mjtTrn.mjTRN_JOINT, target=name)
        set_affine(drive, spring.stiffness, 0.0, 0.0)
    offsets = np.array([spring.offset for spring in springs])
    names = arm.arm.mechanism.joint_names
    return angles_of(spec.compile(), motion, names, np.ones(len(names)), -offsets)


def replay_in_newton(folder: Path, arm: IdentifiedArm, motion: ArmMotion) -> Array:
    """Replay a motion as Newton reads the file, with a drive on each joint."""
    springs = servo_springs(arm)
    builder = driven_builder()
    builder.add_urdf(str(folder / FILE), collapse_fixed_joints=True)
    order = [label.rsplit("/")[-1] for label in builder.joint_label]
    stiffness = {spring.joint.name: spring.stiffness for spring in springs}
    builder.joint_target_ke = [stiffness[name] for name in order]
    return replay_builder(builder, springs, motion)


LOADING = """`arm.urdf` has links, joints, ranges, damping and dry friction in SI units, for any
program that reads URDF, under gravity along -z. A joint counts as its servo is told, so that a
command is its drive's target. The encoder says the offset more.

URDF has no servo. Give each joint a position drive of this stiffness and no damping of its own: the
damping below stands in the file, and dry friction that holds the joint within its servo's band.

"""

URDF_ARM = ArmTarget(
    write=write_arm_urdf,
    ways={
        f"{FILE} in MuJoCo": ArmWay(coverage=SPRINGS, replay=replay_in_mujoco, floor=False),
        f"{FILE} in Newton": ArmWay(coverage=SPRINGS, replay=replay_in_newton, floor=False),
    },
    loading=lambda arm: LOADING + spring_table(arm),
)
