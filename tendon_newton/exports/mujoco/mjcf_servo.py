"""The part of a servo that MJCF has words for: an actuator on its tendon."""

from pathlib import Path
from typing import Any

import numpy as np

from tendon_newton.actuators import find_actuator
from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Array, Recording
from tendon_newton.exports import model_numbers
from tendon_newton.exports.mujoco.mjcf_spool import add_spool, spool_name, tension_name
from tendon_newton.exports.written_program import load_program, rows_of, trajectory_of
from tendon_newton.mechanisms.authoring.mujoco_file import newton_s_mujoco
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.parts import Tendon
from tendon_newton.simulation.hosts.rollout import Trajectory

# MuJoCo's `solimp` with which dry friction creeps least
FRICTION_SHAPE = (0.9999, 0.99999, 1.0e-4, 0.5, 2.0)
TAUT = 1.0e-9  # By which a string is wound in beyond its limit [m], which does not pull at 0
FRICTION_TIME = 1.0e-3  # Time constant of that friction [s]: two steps, the least that MuJoCo takes


def add_servo(spec: Any, tendon: Tendon, model: Model, sign: float, offset: float) -> None:
    """Add an actuator whose control is the desired motor angle [rad].

    That of a force network has the tension [N] for its control. MuJoCo's tendon grows (sign +1) or
    shrinks (-1) when it is wound in; at the offset [m] it has no length. A rotor behind a string
    gets a spool of its own.
    """
    mujoco = newton_s_mujoco()
    friction = model_numbers.dry_friction(model)[0]
    limit = model_numbers.motor_limit(tendon, model)
    actuator = spec.add_actuator(name=tendon.name)
    if find_actuator(model.actuator.name).held:
        actuator.trntype, actuator.target = mujoco.mjtTrn.mjTRN_TENDON, tendon.name
        actuator.gear[0] = sign
        set_friction(spec.tendon(tendon.name), friction)
        actuator.ctrllimited, actuator.ctrlrange = True, [-limit if tendon.direct else 0.0, limit]
        return
    radius, gains = model_numbers.spool_of(tendon, model), model_numbers.servo_gains(tendon, model)
    shift, inertia = model_numbers.angle_shift(tendon, model, offset), armature_of(model)
    add_delay(actuator, model_numbers.number(model, "command_delay", "delay"), spec.option.timestep)
    least = -gains.limit  # a motor brakes its rotor
    if has_spool(tendon, model):
        add_spool(spec, tendon, radius, inertia, shift)
        driven, sign, shift = spec.tendon(spool_name(tendon.name)), 1.0, 0.0
    else:
        driven = spec.tendon(tendon.name)
        driven.armature = inertia / radius**2
    damping = gains.kd
    if tendon.direct or has_spool(tendon, model):
        driven.damping[0] = gains.lost / radius**2
    else:  # a string without a rotor overcomes its friction alone, and no loss of speed pushes it
        least, damping = -radius * friction, gains.kd + gains.lost
    actuator.trntype, actuator.target = mujoco.mjtTrn.mjTRN_TENDON, driven.name
    actuator.gear[0] = sign / radius  # so that its length is an angle and its force a torque
    set_friction(driven, friction)
    actuator.forcelimited, actuator.forcerange = True, [least, gains.limit]
    shift -= model_numbers.command_lead(model)
    if model.actuator.name != "pwm_servo" or shift or damping != gains.kd:
        set_affine(actuator, gains.kp, shift, damping)
        return
    # MuJoCo's own motor asks for a torque and adds what its back-EMF takes, so that the loop's
    # gain is one of torque and its damping that of the back-EMF; its voltage is limited then. It
    # does not know an angle's zero.
    values = {k: v for k, v in model.actuator.values.items() if isinstance(v, float)}
    constant, most = values["torque_constant"], values["max_duty"] * values["supply_voltage"]
    controller = [gains.kp, 0.0, gains.kd, 0.0, 0.0, most]
    actuator.set_to_dcmotor(
        [constant, constant], values["resistance"], controller=controller, ctrlspec=1
    )


def armature_of(model: Model) -> float:
    """Return the inertia of a servo's rotor [kg m2], 0 where it has none."""
    inertia = model.actuator.values.get("armature", 0.0)
    return inertia if isinstance(inertia, float) else 0.0


def has_spool(tendon: Tendon, model: Model) -> bool:
    """Tell whether a servo's rotor turns freely while its string is loose."""
    return not tendon.direct and armature_of(model) > 0.0


def set_affine(actuator: Any, gain: float, shift: float, damping: float) -> None:
    """Let a torque [N m] be gain times error less damping times speed."""
    mujoco = newton_s_mujoco()
    actuator.biastype = mujoco.mjtBias.mjBIAS_AFFINE
    actuator.gainprm[0] = gain
    actuator.biasprm[:3] = [-gain * shift, -gain, -damping]


def add_delay(actuator: Any, delay: float, step: float) -> None:
    """Let an actuator act on old commands."""
    if delay > 0.0:
        actuator.delay = delay
        actuator.nsample = int(np.ceil(delay / step)) + 2


def set_friction(row: Any, friction: float) -> None:
    """Give a tendon or joint dry friction [N, N m] that creeps as little as MuJoCo can."""
    row.frictionloss = friction
    row.solimp_friction, row.solref_friction = FRICTION_SHAPE, (FRICTION_TIME, 1.0)


def replay_file(
    path: Path,
    program: Path,
    mechanism: Mechanism,
    model: Model,
    placed: list[tuple[float, float]],
    recording: Recording,
) -> Trajectory:
    """Replay a recording by the MJCF file alone, from where the program beside it would start.

    `placed` has sign and offset of each tendon, as for `add_servo`.
    """
    hook, rows = load_program(program).make(), rows_of(recording, model)
    hook.reset(rows["theta_d"][0], *rows.get("start", (None, None)))
    mujoco = newton_s_mujoco()
    mj_model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(mj_model)
    places = [mj_model.joint(joint.name).qposadr[0] for joint in mechanism.joints]
    data.qpos[places] = hook.data.qpos[hook.places]
    for tendon, angle in zip(mechanism.tendons, hook.read().angle, strict=True):
        if has_spool(tendon, model):
            wound = model_numbers.spool_of(tendon, model) * angle
            data.joint(spool_name(tendon.name)).qpos = wound + TAUT
    fill_history(mj_model, data, rows["theta_d"][0])
    joints: list[Array] = []
    readings: list[Any] = []
    for now, command in zip(rows["t"] - rows["t"][0], rows["theta_d"], strict=True):
        while data.time < now - 0.5 * mj_model.opt.timestep:
            mujoco.mj_step(mj_model, data)
        data.ctrl[:] = command
        mujoco.mj_forward(mj_model, data)
        joints.append(data.qpos[places].copy())
        readings.append(file_row(mj_model, data, mechanism, model, placed))
    angle, rate, force = np.array(readings).transpose(1, 0, 2)
    found = {"angle": angle, "rate": rate, "force": force, "joints": np.array(joints)}
    return trajectory_of(recording, found)


def fill_history(mj_model: Any, data: Any, command: Array) -> None:
    """Let actuators with a delay begin as if a command had always been there."""
    for number_, samples in enumerate(mj_model.actuator_history[:, 0]):
        if samples:
            times = mj_model.opt.timestep * np.arange(-samples + 1.0, 1.0)
            newton_s_mujoco().mj_initCtrlHistory(
                mj_model, data, number_, times, np.full(samples, command[number_])
            )


def file_row(
    mj_model: Any, data: Any, mechanism: Mechanism, model: Model, placed: list[tuple[float, float]]
) -> tuple[list[float], list[float], list[float]]:
    """Return motor angles [rad], speeds [rad/s] and tensions [N] of MuJoCo's own state."""
    kind = int(newton_s_mujoco().mjtConstraint.mjCNSTR_FRICTION_TENDON)
    angles, rates, forces = [], [], []
    for tendon, (sign, offset) in zip(mechanism.tendons, placed, strict=True):
        radius = model_numbers.spool_of(tendon, model)
        if has_spool(tendon, model):
            spool = data.joint(spool_name(tendon.name))
            angles.append(float(spool.qpos[0]) / radius)
            rates.append(float(spool.qvel[0]) / radius)
            forces.append(float(data.sensor(tension_name(tendon.name)).data[0]))
            continue
        number_ = mj_model.tendon(tendon.name).id
        shift = model_numbers.angle_shift(tendon, model, offset)
        angles.append(sign * data.ten_length[number_] / radius + shift)
        rates.append(sign * data.ten_velocity[number_] / radius)
        row = (data.efc_type == kind) & (data.efc_id == number_)
        friction = sign * float(data.efc_force[row].sum())
        force = data.actuator_force[mj_model.actuator(tendon.name).id] / radius
        first, count = mj_model.ten_J_rowadr[number_], mj_model.ten_J_rownnz[number_]
        columns = mj_model.ten_J_colind[first : first + count]
        rate_change = data.ten_J[first : first + count] @ data.qacc[columns]
        rotor = sign * mj_model.tendon_armature[number_] * rate_change
        forces.append(force + friction - rotor)
    return angles, rates, forces
