"""An arm whose servos are springs, in joints that count as their servos are told."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import newton
import numpy as np
from newton.solvers import SolverMuJoCo
from scipy.spatial.transform import Rotation

from tendon_newton.arms.arm import ArmMotion
from tendon_newton.arms.arm_file import IdentifiedArm
from tendon_newton.data.recording import Array
from tendon_newton.exports.arms.mujoco_arm import arm_spec, model_text
from tendon_newton.exports.arms.replaying import angles_of
from tendon_newton.exports.model_numbers import coverage_of, number
from tendon_newton.mechanisms.authoring.mujoco_file import TIME_STEP
from tendon_newton.mechanisms.geometry.joints import Joint
from tendon_newton.mechanisms.usd.usd_asset import adopt_orphans

# What joints and springs say of each effect: an offset is part of where a joint counts from
SPRINGS = coverage_of(("position_offset",), ("actuator_lag", "deadband", "backlash"))


@dataclass(frozen=True, kw_only=True)
class ServoSpring:
    """A joint that counts as its servo is told, and the servo as a spring behind it.

    Units are those of a revolute joint; for a prismatic one read N for N m and m for rad.
    """

    joint: Joint
    stiffness: float  # [N m/rad]
    damping: float  # Of the servo alone [N m s/rad]
    friction: float  # Dry friction that holds the joint within the servo's band [N m]
    offset: float  # What the encoder says beyond the joint's angle [rad]
    force_limit: float  # [N m]


def servo_springs(arm: IdentifiedArm) -> tuple[ServoSpring, ...]:
    """Return the joints of an arm, with the numbers that its servos have in MJCF."""
    compiled, place = arm_spec(arm).compile(), arm.arm
    mechanism = place.mechanism
    out = []
    for j, (joint, model, sign, zero) in enumerate(
        zip(mechanism.joints, arm.models, place.sign, place.zero, strict=True)
    ):
        offset = number(model, "position_offset", "angle")
        pulls = (abs(float(t.moment_arm[j])) * t.force_limit for t in mechanism.tendons)
        out.append(
            ServoSpring(
                joint=counted(joint, float(sign), float(zero + sign * offset)),
                stiffness=float(compiled.actuator_gainprm[j, 0]),
                damping=-float(compiled.actuator_biasprm[j, 2]),
                friction=float(compiled.dof_frictionloss[compiled.joint(joint.name).dofadr[0]]),
                offset=float(offset),
                force_limit=sum(pulls),
            )
        )
    return tuple(out)


def counted(joint: Joint, sign: float, zero: float) -> Joint:
    """Return a joint whose position is what a servo counts: q = sign * position + zero."""
    place, turn = joint.parent_position, joint.parent_rotation
    if joint.kind == "revolute":
        turn = turn @ Rotation.from_rotvec(zero * joint.axis).as_matrix()
    else:
        place = place + turn @ (zero * joint.axis)
    ends = sorted(sign * (end - zero) for end in joint.limits)
    return replace(
        joint, parent_position=place, parent_rotation=turn, axis=sign * joint.axis,
        limits=(ends[0], ends[1]), rest=sign * (joint.rest - zero),
    )  # fmt: skip


def spring_table(arm: IdentifiedArm) -> str:
    """Return a table of what the servos of an arm have, and what stands for it, in Markdown."""
    rows = [
        f"| {s.joint.name} | {s.stiffness:.3g} N m/rad | {s.damping:.3g} N m s/rad "
        f"| {s.friction:.3g} N m | {1e3 * s.offset:.0f} mrad | {model_text(model)} |"
        for s, model in zip(servo_springs(arm), arm.models, strict=True)
    ]
    head = "| joint | stiffness | damping | dry friction | offset | servo |"
    return "\n".join([head, "|---|---|---|---|---|---|", *rows])


def driven_builder() -> Any:
    """Return an empty builder that takes what files say to MuJoCo."""
    builder = newton.ModelBuilder()
    SolverMuJoCo.register_custom_attributes(builder)
    return builder


def replay_builder(builder: Any, springs: Sequence[ServoSpring], motion: ArmMotion) -> Array:
    """Replay a motion of an arm that a builder has read, by position drives on its joints.

    Returns:
        What the encoders report [rad], shape (T, J).
    """
    adopt_orphans(builder, "arm")
    model = builder.finalize(device="cpu")
    solver: Any = SolverMuJoCo(model, disable_contacts=True, use_mujoco_cpu=True)
    theirs = solver.mj_model
    theirs.opt.timestep = TIME_STEP
    called = {label.rsplit("/")[-1]: label.replace("/", "_") for label in builder.joint_label}
    names = [called[spring.joint.name] for spring in springs]
    offsets = np.array([spring.offset for spring in springs])
    return angles_of(theirs, motion, names, np.ones(len(springs)), -offsets)
