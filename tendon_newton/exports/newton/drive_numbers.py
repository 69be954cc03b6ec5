"""What a drive is written with: tendons and their ways, joints, inertias and the longest step."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from tendon_newton.actuators import find_actuator
from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Array
from tendon_newton.errors import InvalidModelFile
from tendon_newton.exports.model_law import ModelLaw
from tendon_newton.exports.model_numbers import command_span, number, spool_of
from tendon_newton.exports.mujoco.mujoco_program import joint_rows
from tendon_newton.exports.newton.prims import LONGEST_STEP
from tendon_newton.law.spool import LEAST_ROTOR
from tendon_newton.mechanisms.authoring.mujoco_file import mujoco_spec, newton_s_mujoco
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.parts import Tendon, excursion, moment_arms
from tendon_newton.simulation.model.parameter_table import force_limit_of, spool_radius_of

# Share of a mechanism's momentum [1] that a servo's damping may take in one step
DAMPED_SHARE = 0.3
POSES = 3  # Poses of each joint at which its inertia is looked at
DEGREE = 6  # Highest sum of powers of a routed tendon's terms
SAMPLES = 9  # Samples of each joint's range at which it is fitted
SWING = (-np.pi, np.pi)  # Range of a joint without end stops [rad]


@dataclass(frozen=True, kw_only=True)
class TendonPath:
    """Excursion as a sum of factors times powers of the joints."""

    factor: Array  # [m], shape (K,)
    powers: tuple[tuple[int, ...], ...]  # Power of each joint, shape (K, J)
    stray: float  # Most by which it strays from the tendon in its range [m]


def columns(q: Array, powers: Sequence[tuple[int, ...]]) -> Array:
    """Return products of powers of the joints, shape (N, K)."""
    return np.stack([np.prod(q ** np.array(row), axis=1) for row in powers], axis=1)


def path_of(mechanism: Mechanism, tendon: Tendon) -> TendonPath:
    """Return a tendon's way: exact with constant moment arms, else fitted over its range."""
    count = len(mechanism.joints)
    if tendon.route is None:
        powers = ((0,) * count, *(tuple(map(int, row)) for row in np.eye(count)))
        factor = np.array([tendon.excursion_offset, *tendon.moment_arm])
        return TendonPath(factor=factor, powers=powers, stray=0.0)
    used = [j for j in range(count) if np.any(tendon.moment_arm[j] != 0.0)]
    ends = [
        joint.limits if np.isfinite(joint.limits).all() else SWING for joint in mechanism.joints
    ]
    grid = [np.linspace(*ends[j], SAMPLES) if j in used else [0.0] for j in range(count)]
    q = np.array(list(product(*grid)))
    length = np.array([excursion(tendon, row) for row in q])
    choices = [range(DEGREE + 1) if j in used else (0,) for j in range(count)]
    powers = tuple(row for row in product(*choices) if sum(row) <= DEGREE)
    solved, *_ = np.linalg.lstsq(columns(q, powers), length, rcond=None)
    factor = np.asarray(solved, dtype=np.float64)
    stray = float(np.abs(columns(q, powers) @ factor - length).max())
    return TendonPath(factor=factor, powers=powers, stray=stray)


def drive_numbers(
    mechanism: Mechanism,
    corrected: Mechanism,
    model: Model,
    paths: list[TendonPath],
    network: dict[str, Any] | None,
    step: float,
) -> tuple[ModelLaw, dict[str, Any]]:
    """Return a drive's law, and what it knows of its bench.

    `mechanism` is the bench before the model's effects, which the drive has itself, and `corrected`
    as its file has it. The step is the longest [s].
    """
    rotor = find_actuator(model.actuator.name).rotor
    direct = [tendon.direct for tendon in mechanism.tendons]
    if len(set(direct)) > 1:
        raise InvalidModelFile("A bench for Newton must have strings or shafts, not both.")
    rows = zip(mechanism.tendons, paths, strict=True)
    joint_inertias = [least_inertia(corrected, row) for row in np.eye(len(corrected.joints))]
    free = rotor and not any(direct)  # a rotor stands between the motor and the string
    law = ModelLaw(model, free)
    return law, {
        "PARAMETERS": law.parameters,
        "SERVO_ROWS": [tendon_row(corrected, tendon, path, model) for tendon, path in rows],
        "JOINT_ROWS": [
            {
                **row,
                "written": [new.stiffness, new.damping],
                "stop_stiffness": new.stop_stiffness,
                "stop_damping": new.stop_damping,
                "inertia": inertia,
            }
            for row, new, inertia in zip(
                joint_rows(mechanism), corrected.joints, joint_inertias, strict=True
            )
        ],
        "SPAN": command_span(mechanism),
        "PERIOD": number(model, "sample_period_error", "scale"),
        "NETWORK": network,
        "TIME_STEP": step,
        "COMMAND_DELAY": number(model, "command_delay", "delay"),
        "RIGID": free and "tendon_compliance" not in law.names,
    }


def own_joints(mechanism: Mechanism, model: Model) -> dict[str, dict[str, float]]:
    """Return what joints are with our drive, which has their end stops and dry friction itself.

    A shaft's rotor is theirs.

    The limits of the file are out of the way.
    """
    out = {joint.prim: {"newton:friction": 0.0} for joint in mechanism.joints}
    for joint in mechanism.joints:
        lower, upper = joint.limits
        scale = math.degrees(1.0) if joint.kind == "revolute" else 1.0
        if math.isfinite(lower) and math.isfinite(upper):
            span = upper - lower
            out[joint.prim]["physics:lowerLimit"] = scale * (lower - span)
            out[joint.prim]["physics:upperLimit"] = scale * (upper + span)
    if find_actuator(model.actuator.name).rotor:
        for tendon in mechanism.tendons:
            driven = np.flatnonzero(tendon.moment_arm)
            if tendon.direct and len(driven) == 1:
                ratio = float(tendon.moment_arm[driven[0]]) / spool_of(tendon, model)
                armature = float(model.actuator.values["armature"])
                prim = mechanism.joints[driven[0]].prim
                out[prim]["newton:armature"] = armature * ratio**2
    return out


def tendon_row(
    corrected: Mechanism, tendon: Tendon, path: TendonPath, model: Model
) -> dict[str, Any]:
    """Return what a drive knows of one tendon."""
    rotor = 0.0
    if find_actuator(model.actuator.name).rotor:
        armature = max(float(model.actuator.values["armature"]), LEAST_ROTOR)
        rotor = armature / spool_of(tendon, model) ** 2
    return {
        "name": tendon.name,
        "factor": [float(x) for x in path.factor],
        "powers": [list(row) for row in path.powers],
        "inertia": least_inertia(corrected, tendon),
        "rotor": rotor,
        "radius": spool_radius_of(model) or tendon.spool_radius,
        "limit": force_limit_of(model) or tendon.force_limit,
        "least": -math.inf if tendon.direct else 0.0,
    }


def longest_step(mechanism: Mechanism, model: Model) -> float:
    """Return the longest step [s] that a servo's damping allows, which is explicit."""
    if find_actuator(model.actuator.name).rotor:
        return LONGEST_STEP
    values = model.actuator.values
    held = float(values.get("hold_damping", 0.0)) * float(values.get("force_scale", 1.0))
    damping = held + number(model, "viscous_friction", "coefficient")  # [N s/rad]
    steps = [LONGEST_STEP]
    for tendon in mechanism.tendons:
        radius = spool_of(tendon, model)
        if damping > 0.0:
            steps.append(DAMPED_SHARE * least_inertia(mechanism, tendon) * radius / damping)
    least = min(steps)
    return LONGEST_STEP / math.ceil(LONGEST_STEP / least - 1.0e-9)


def least_inertia(mechanism: Mechanism, pulled: Tendon | Array) -> float:
    """Return the least inertia with which a mechanism answers a string [kg], or a joint's torque.

    What is pulled is a tendon, or a direction of the joints.
    """
    mujoco = newton_s_mujoco()
    compiled = mujoco_spec(mechanism).compile()
    data = mujoco.MjData(compiled)
    names = [joint.name for joint in mechanism.joints]
    places = [compiled.joint(name).qposadr[0] for name in names]
    dofs = [compiled.joint(name).dofadr[0] for name in names]
    found = []
    for share in np.linspace(0.0, 1.0, POSES):
        ends = [j.limits if np.isfinite(j.limits).all() else SWING for j in mechanism.joints]
        q = np.array([low + share * (high - low) for low, high in ends])
        data.qpos[places] = q
        mujoco.mj_forward(compiled, data)
        arm = np.zeros((1, compiled.nv))
        arm[0, dofs] = moment_arms(pulled, q) if isinstance(pulled, Tendon) else pulled
        answer = np.zeros_like(arm)
        mujoco.mj_solveM(compiled, data, answer, arm)
        found.append(1.0 / float(arm[0] @ answer[0]))
    return min(found)
