"""Export to Newton: the bench in USD with actuator prims, and a drive for what prims cannot say."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from tendon_newton.actuators import find_actuator
from tendon_newton.data.files.text_file import write_text
from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Array, Recording
from tendon_newton.effects import EFFECTS
from tendon_newton.errors import InvalidModelFile
from tendon_newton.exports.base import Exported, ExportTarget
from tendon_newton.exports.bench_file import write_bench
from tendon_newton.exports.model_numbers import (
    coverage_of,
    not_exact,
    number,
    refuse_damaged,
    refuse_kinematic,
    spool_of,
)
from tendon_newton.exports.mujoco.program import NetworkFacts
from tendon_newton.exports.network_export import NETWORK_FILE, exported_network
from tendon_newton.exports.newton.page import loading_text
from tendon_newton.exports.newton.path import SWING, TendonPath, path_of
from tendon_newton.exports.newton.plain import IN_THE_PRIMS, plain_joints, plain_replay
from tendon_newton.exports.newton.prims import (
    LONGEST_STEP,
    drives_one_joint,
    gearing_of,
    own_prims,
    plain_prims,
    write_actuators,
)
from tendon_newton.exports.newton.program import DriveNumbers, drive_text
from tendon_newton.exports.written_program import load_program, rows_of, trajectory_of
from tendon_newton.mechanisms.authoring.correction import Correction, correct, with_joints
from tendon_newton.mechanisms.authoring.mujoco_file import mujoco_spec, newton_s_mujoco
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.parts import Tendon, moment_arms
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.simulation.hosts.replay import replay
from tendon_newton.simulation.hosts.rollout import Trajectory
from tendon_newton.simulation.model.parameter_table import spool_radius_of

BENCH_FILE, DRIVE_FILE, PLAIN_FILE = "bench.usda", "bench_drive.usda", "bench_newton.usda"
PROGRAM_FILE = "tendon_drive.py"
DAMPED_SHARE = 0.3
"""Share of a mechanism's momentum [1] that a servo's damping may take in one step."""
LEAST_ROTOR = 1.0e-8
"""Inertia [kg m2] of the smallest rotor."""
POSES = 3
"""Poses of each joint at which its inertia is looked at."""
SENSORS = (
    "load_cell_delay",
    "load_cell_lag",
    "load_cell_gain",
    "load_cell_bias",
    "load_cell_drift",
)
NEARLY = (
    "coulomb_friction",
    "asymmetric_friction",
    "stribeck_friction",
    "load_dependent_friction",
    "gear_load_friction",
    "load_stribeck_friction",
    "holding_friction",
    "routing_friction",
    "speed_limit",
    "joint_dry_friction",
)
COVERAGE = coverage_of(tuple({*EFFECTS} - {*NEARLY, *SENSORS}), NEARLY)
"""What the drive says of each effect: friction bends before it slides, and nobody has a cell."""


def write_newton_target(folder: Path, mechanism: Mechanism, model: Model) -> Exported:
    """Write the bench, its actuator prims, and the drive.

    Raises:
        InvalidAsset: Two joints or tendons share the last part of their paths.
        InvalidModelFile: Newton cannot hold the bench or its servo.
        InvalidOutput: A file cannot be written.
    """
    refuse_kinematic(model, "Newton")
    refuse_damaged(model)
    refuse_shared_joints(mechanism)
    mujoco_spec(mechanism)  # refuses a bench that SolverMuJoCo's own names cannot hold
    correction = corrected_bench(mechanism, model)
    write_bench(folder / BENCH_FILE, correction, model)
    network, held = exported_network(folder, model)
    step = longest_step(correction.corrected, held)
    own = own_prims(mechanism)
    write_actuators(folder / DRIVE_FILE, folder / BENCH_FILE, own, own_joints(mechanism, model))
    paths = [path_of(mechanism, tendon) for tendon in mechanism.tendons]
    numbers = drive_numbers(mechanism, correction.corrected, held, paths, network, step)
    program = folder / PROGRAM_FILE
    write_text(program, drive_text(held, numbers))
    files = [folder / name for name in (BENCH_FILE, DRIVE_FILE, PROGRAM_FILE)]
    replays: dict[str, Any] = {
        PROGRAM_FILE: lambda run: replay_drive(folder, mechanism, model, run)
    }
    left_out = {PROGRAM_FILE: not_exact(model, COVERAGE)}
    plain = plain_prims(mechanism, model, LONGEST_STEP)
    if plain is not None:
        joints = plain_joints(mechanism, model)
        write_actuators(folder / PLAIN_FILE, folder / BENCH_FILE, plain, joints)
        files.append(folder / PLAIN_FILE)
        replays[PLAIN_FILE] = lambda run: trajectory_of(
            run,
            **plain_replay(
                folder / PLAIN_FILE, mechanism, model, started_rows(mechanism, model, run)
            ),
        )
        left_out[PLAIN_FILE] = not_exact(model, IN_THE_PRIMS)
    if network is not None:
        files.append(folder / NETWORK_FILE)
    return Exported(
        files=tuple(files),
        loading=loading_text(
            network=network is not None, plain=plain is not None, stray=max(p.stray for p in paths)
        ),
        replays=replays,
        left_out=left_out,
    )


def refuse_shared_joints(mechanism: Mechanism) -> None:
    """Refuse a bench with a joint that no tendon drives, or several."""
    arms = np.array([tendon.moment_arm for tendon in mechanism.tendons])
    for joint, count in zip(mechanism.joints, np.count_nonzero(arms, axis=0), strict=True):
        if count != 1:
            raise InvalidModelFile(
                f"Newton's actuators have one command per joint, so that one tendon must drive "
                f"joint {joint.name!r} of {mechanism.name!r}; it has {count}"
            )


def corrected_bench(mechanism: Mechanism, model: Model) -> Correction:
    """Return a bench with what USD has numbers for, links that only resist more included."""
    correction = correct(mechanism, replace(model, bench_overrides={}))
    heavier = number(model, "inertia_error", "scale")
    corrected = with_joints(
        correction.corrected,
        lambda j: replace(j, mass=j.mass * heavier, inertia=j.inertia * heavier),
    )
    corrected = replace(corrected, gravity=corrected.gravity / heavier)
    return replace(correction, asset=load_mechanism(mechanism.asset), corrected=corrected)


def drive_numbers(
    mechanism: Mechanism,
    corrected: Mechanism,
    model: Model,
    paths: list[TendonPath],
    network: NetworkFacts | None,
    step: float,
) -> DriveNumbers:
    """Return what a drive knows of its bench.

    Args:
        mechanism: The bench before the model's effects, which the drive has itself.
        corrected: As its file has it.
        model: Actuator and effects, with the hold law of its network.
        paths: Ways of the tendons.
        network: Its force network, if it has one.
        step: Longest step [s].
    """
    rotor = find_actuator(model.actuator.name).rotor
    direct = [tendon.direct for tendon in mechanism.tendons]
    if len(set(direct)) > 1:
        raise InvalidModelFile("A bench for Newton must have strings or shafts, not both.")
    rows = zip(mechanism.tendons, paths, strict=True)
    joint_inertias = [least_inertia(corrected, row) for row in np.eye(len(corrected.joints))]
    asked = None
    if network is not None:
        asked = {"file": network.file, "asked": [network.rate, network.window, network.streaming]}
    return DriveNumbers(
        tendons=[tendon_row(corrected, tendon, path, model) for tendon, path in rows],
        joints=[
            {
                "name": old.name,
                "stiffness": old.stiffness,
                "rest": old.rest,
                "damping": old.damping,
                "lower": old.limits[0],
                "upper": old.limits[1],
                "written": [new.stiffness, new.damping],
                "stop": [new.stop_stiffness, new.stop_damping],
                "friction": old.friction,
                "inertia": inertia,
            }
            for old, new, inertia in zip(
                mechanism.joints, corrected.joints, joint_inertias, strict=True
            )
        ],
        free_spool=rotor and not any(direct),
        delay=number(model, "command_delay", "delay"),
        step=step,
        period=number(model, "sample_period_error", "scale"),
        network=asked,
    )


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
            if tendon.direct and drives_one_joint(tendon):
                ratio = gearing_of(tendon, model).ratio
                (j,) = np.flatnonzero(tendon.moment_arm)
                armature = float(model.actuator.values["armature"])
                out[mechanism.joints[j].prim]["newton:armature"] = armature * ratio**2
    return out


def tendon_row(
    corrected: Mechanism, tendon: Tendon, path: TendonPath, model: Model
) -> dict[str, Any]:
    """Return what a drive knows of one tendon."""
    radius = spool_radius_of(model) or tendon.spool_radius
    spool = radius * number(model, "spool_radius_error", "scale")
    rotor = 0.0
    if find_actuator(model.actuator.name).rotor:
        rotor = max(float(model.actuator.values["armature"]), LEAST_ROTOR) / spool**2
    return {
        "name": tendon.name,
        "factor": [float(x) for x in path.factor],
        "powers": [list(row) for row in path.powers],
        "arm": [float(x) for x in tendon.moment_arm],
        "inertia": least_inertia(corrected, tendon),
        "rotor": rotor,
        "radius": radius,
        "limit": tendon.force_limit,
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

    Args:
        mechanism: The bench.
        pulled: The tendon, or a direction of the joints.
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


def replay_drive(
    folder: Path, mechanism: Mechanism, model: Model, recording: Recording
) -> Trajectory:
    """Replay a recording with the written drive, from where our own simulation begins."""
    program = load_program(folder / PROGRAM_FILE)
    rows = started_rows(mechanism, model, recording)
    found = program.replay(program.Simulation(device="cpu"), rows)
    return trajectory_of(recording, **found)


def started_rows(mechanism: Mechanism, model: Model, recording: Recording) -> dict[str, Any]:
    """Return what a program needs of a recording, with where it begins."""
    rows = rows_of(recording)
    rows["joints"] = replay([recording], model)[0].joint_position[0]
    if "start" in rows:
        _, rate = rows.pop("start")
        rates = np.zeros(len(mechanism.joints))
        for tendon, speed in zip(mechanism.tendons, rate, strict=True):
            arm = moment_arms(tendon, rows["joints"])
            radius = spool_radius_of(model) or tendon.spool_radius
            rates += arm * (speed * radius / (arm @ arm))
        rows["rates"] = rates
    return rows


NEWTON = ExportTarget(
    summary="USD with actuator prims, and a drive for Newton with what prims cannot say",
    coverage=COVERAGE,
    write=write_newton_target,
)
