"""Export to URDF: the corrected links and joints, for any program that reads robots."""

import math
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from scipy.spatial.transform import Rotation

from tendon_newton.data.files.text_file import write_text
from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Array
from tendon_newton.exports.export_target import Exported, ExportTarget
from tendon_newton.exports.model_numbers import coverage_of, not_exact, refuse_damaged
from tendon_newton.mechanisms.authoring.correction import correct
from tendon_newton.mechanisms.geometry.joints import Joint
from tendon_newton.mechanisms.geometry.mechanism import Mechanism

ROBOT_FILE = "bench.urdf"
BASE = "base"
# URDF has neither springs nor tendons nor gravity
COVERAGE = coverage_of(("joint_damping_error", "joint_dry_friction"), ())
UNBOUNDED = 1.0e6  # A speed [rad/s, m/s] that no joint reaches; URDF wants one


def write_urdf_target(folder: Path, mechanism: Mechanism, model: Model) -> Exported:
    """Write `bench.urdf`.

    Raises:
        InvalidModelFile: A number is missing or out of range.
        InvalidOutput: The file cannot be written.
    """
    refuse_damaged(model)
    corrected = correct(mechanism, replace(model, bench_overrides={})).corrected
    named = [replace(joint, name=joint_name(joint)) for joint in corrected.joints]
    efforts = [
        sum(abs(float(t.moment_arm[place])) * t.force_limit for t in corrected.tendons)
        for place in range(len(named))
    ]
    path = folder / ROBOT_FILE
    write_text(path, robot_text(mechanism.name, named, efforts))
    left = not_exact(model, COVERAGE)
    return Exported(files=(path,), loading=LOADING, left_out={ROBOT_FILE: left}, checked=CHECKED)


def joint_name(joint: Joint) -> str:
    """Return a joint's name: its path in the asset, which no other has."""
    return "_".join(joint.prim.strip("/").split("/")[1:])


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


CHECKED = """Nothing can be replayed: URDF has no servo. The file's inertias, places and axes are
those of the bench in MuJoCo (a test compares their mass matrices)."""
LOADING = """Any program that reads URDF takes `bench.urdf`: links, joints, ranges, damping and
dry friction, in SI units. URDF has no springs, tendons or servos. Add the return springs yourself,
or take another target.
"""

URDF = ExportTarget(coverage=COVERAGE, write=write_urdf_target)
