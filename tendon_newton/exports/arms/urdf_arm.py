"""An identified arm as URDF: joints that count as their servos do, and what holds them in passing.

URDF has no servo: a program gives each joint a drive of the stiffness that the page lists.
"""

import math
import xml.etree.ElementTree as ET
from collections.abc import Sequence
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
from tendon_newton.mechanisms.authoring.mujoco_file import TIME_STEP, newton_s_mujoco
from tendon_newton.mechanisms.geometry.joints import Joint

FILE = "arm.urdf"
BASE = "base"
UNBOUNDED = 1.0e6  # A speed [rad/s, m/s] that no joint reaches; URDF wants one
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


def robot_text(name: str, joints: Sequence[Joint], efforts: Sequence[float]) -> str:
    """Return joints, whose names all differ, and their links as URDF.

    `efforts` are the most that moves each joint [N m, N].
    """
    robot = ET.Element("robot", name=name)
    ET.SubElement(robot, "link", name=BASE)
    for joint, effort in zip(joints, efforts, strict=True):
        add_link(robot, joint)
        add_joint(robot, joint, joints[joint.parent] if joint.parent >= 0 else None, effort)
    ET.indent(robot)
    return ET.tostring(robot, encoding="unicode") + "\n"


def link_name(joint: Joint) -> str:
    """Return the name of the link that a joint moves."""
    return f"{joint.name}_link"


def text_of(values: Array) -> str:
    """Return numbers as URDF writes them."""
    return " ".join(f"{value:.12g}" for value in values)


def add_link(robot: ET.Element, joint: Joint) -> None:
    """Add the link that a joint moves; its frame is the joint's."""
    turn = joint.child_rotation
    centre = turn.T @ (joint.center_of_mass - joint.child_position)
    tensor = turn.T @ joint.inertia @ turn
    inertial = ET.SubElement(ET.SubElement(robot, "link", name=link_name(joint)), "inertial")
    ET.SubElement(inertial, "origin", xyz=text_of(centre), rpy="0 0 0")
    ET.SubElement(inertial, "mass", value=f"{joint.mass:.12g}")
    entries = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2)}
    entries["izz"] = (2, 2)
    ET.SubElement(
        inertial, "inertia", {name: f"{tensor[place]:.12g}" for name, place in entries.items()}
    )


def add_joint(robot: ET.Element, joint: Joint, parent: Joint | None, effort: float) -> None:
    """Add a joint between two links, at which tendons pull with an effort [N m, N] at most."""
    place, turn = joint.parent_position, joint.parent_rotation
    if parent is not None:
        place = parent.child_rotation.T @ (place - parent.child_position)
        turn = parent.child_rotation.T @ turn
    bounded = all(math.isfinite(end) for end in joint.limits)
    kind = joint.kind if bounded else "continuous"
    out = ET.SubElement(robot, "joint", name=joint.name, type=kind)
    angles = Rotation.from_matrix(turn).as_euler("xyz")
    ET.SubElement(out, "origin", xyz=text_of(place), rpy=text_of(angles))
    ET.SubElement(out, "parent", link=BASE if parent is None else link_name(parent))
    ET.SubElement(out, "child", link=link_name(joint))
    ET.SubElement(out, "axis", xyz=text_of(joint.axis))
    limit = {"effort": f"{effort:.12g}", "velocity": f"{UNBOUNDED:g}"}
    if bounded:
        limit |= {"lower": f"{joint.limits[0]:.12g}", "upper": f"{joint.limits[1]:.12g}"}
    ET.SubElement(out, "limit", limit)
    dynamics = {"damping": f"{joint.damping:.12g}", "friction": f"{joint.friction:.12g}"}
    ET.SubElement(out, "dynamics", dynamics)


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
