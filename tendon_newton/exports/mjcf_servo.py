"""The part of a servo that MJCF has words for: an actuator on its tendon."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from tendon_newton.actuators import find_actuator
from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Array, Recording
from tendon_newton.effects import find_effect
from tendon_newton.mechanisms.authoring.mujoco_file import newton_s_mujoco
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.parts import Tendon
from tendon_newton.simulation.hosts.rollout import Trajectory
from tendon_newton.simulation.hosts.timeline import make_timeline
from tendon_newton.simulation.model.parameter_table import spool_radius_of

FRICTION_SHAPE = (0.9999, 0.99999, 1.0e-4, 0.5, 2.0)
"""MuJoCo's `solimp` with which dry friction creeps least."""
FRICTION_TIME = 1.0e-3
"""Its time constant [s]: two steps, the least that MuJoCo takes."""


def number(model: Model, effect: str, parameter: str) -> float:
    """Return a number of an effect, its null value where the model does not have it."""
    for entry in model.effects:
        if entry.name == effect:
            return float(entry.values[parameter])
    return next(p.null for p in find_effect(effect).parameters if p.name == parameter)


def spool_of(tendon: Tendon, model: Model) -> float:
    """Return the radius [m] of the spool as the string meets it."""
    radius = spool_radius_of(model)
    nominal = tendon.spool_radius if radius is None else radius
    return nominal * number(model, "spool_radius_error", "scale")


def angle_shift(tendon: Tendon, model: Model, offset: float) -> float:
    """Return the motor angle [rad] at which MuJoCo's tendon has no length."""
    wound = offset + number(model, "tendon_slack", "length")
    return wound / spool_of(tendon, model) + number(model, "position_offset", "angle")


def add_servo(spec: Any, tendon: Tendon, model: Model, sign: float, offset: float) -> None:
    """Add an actuator whose control is the desired motor angle [rad].

    That of a force network has the tension [N] for its control.

    Args:
        spec: MuJoCo's editable model.
        tendon: The tendon.
        model: Actuator and effects.
        sign: Whether MuJoCo's tendon grows (+1) or shrinks (-1) when it is wound in.
        offset: Excursion [m] where it has no length.
    """
    mujoco = newton_s_mujoco()
    actuator = spec.add_actuator(
        name=tendon.name, trntype=mujoco.mjtTrn.mjTRN_TENDON, target=tendon.name
    )
    add_friction(spec.tendon(tendon.name), model)
    limit = min(tendon.force_limit, number(model, "force_saturation", "limit"))
    least = -limit if tendon.direct else 0.0
    if find_actuator(model.actuator.name).held:
        actuator.gear[0] = sign
        actuator.ctrllimited, actuator.ctrlrange = True, [least, limit]
        return
    radius = spool_of(tendon, model)
    shift = angle_shift(tendon, model, offset)
    actuator.gear[0] = sign / radius  # so that its length is an angle and its force a torque
    if find_actuator(model.actuator.name).rotor:
        least = -limit  # a motor brakes its rotor
    elif not tendon.direct:
        least = -spec.tendon(tendon.name).frictionloss  # and overcomes its own friction
    actuator.forcelimited, actuator.forcerange = True, [least * radius, limit * radius]
    add_delay(actuator, number(model, "command_delay", "delay"), spec.option.timestep)
    lost = number(model, "viscous_friction", "coefficient") * radius
    values = {k: v for k, v in model.actuator.values.items() if isinstance(v, float)}
    scale = number(model, "gain_error", "scale")
    if model.actuator.name == "ideal":
        set_affine(actuator, values["gain"] * scale * radius, shift, lost)
        return
    spec.tendon(tendon.name).armature = values["armature"] / radius**2
    if model.actuator.name == "pd_torque":
        top = min(values["max_torque"], limit * radius)
        actuator.forcerange = [-top, top]
        set_affine(actuator, values["kp"] * scale, shift, values["kd"] + lost)
        return
    add_dc_motor(actuator, values, scale, shift, lost)


def add_dc_motor(
    actuator: Any, values: dict[str, float], scale: float, shift: float, lost: float
) -> None:
    """Make an actuator a DC motor behind a position loop.

    MuJoCo's own motor asks for a torque and adds what its back-EMF takes, so that the loop's gain
    is one of torque and its damping that of the back-EMF; its voltage is limited then. It knows
    neither an angle's zero nor viscous friction: with these the limit of the duty is left out.

    Args:
        actuator: The actuator.
        values: Numbers of a `pwm_servo`.
        scale: What its gain is multiplied by [1].
        shift: Motor angle [rad] at which the tendon has no length.
        lost: Viscous friction [N m s/rad].
    """
    constant, resistance = values["torque_constant"], values["resistance"]
    supply = values["supply_voltage"]
    per_rad = values["duty_per_rad"] * scale
    shift -= values.get("duty_offset", 0.0) / per_rad
    gain = per_rad * supply * constant / resistance
    brake = constant**2 / resistance
    if shift or lost:
        set_affine(actuator, gain, shift, brake + lost)
        return
    controller = [gain, 0.0, brake, 0.0, 0.0, values["max_duty"] * supply]
    actuator.set_to_dcmotor([constant, constant], resistance, controller=controller, ctrlspec=1)


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


def add_friction(row: Any, model: Model) -> None:
    """Give a tendon the dry friction of its servo's gear, as far as it is one number [N]."""
    winding, unwinding = (
        number(model, "asymmetric_friction", way) for way in ("winding", "unwinding")
    )
    row.frictionloss = (
        number(model, "coulomb_friction", "force")
        + number(model, "stribeck_friction", "coulomb_force")
        + 0.5 * (winding + unwinding)
    )
    row.solimp_friction = FRICTION_SHAPE
    row.solref_friction = (FRICTION_TIME, 1.0)


def replay_file(
    path: Path,
    mechanism: Mechanism,
    model: Model,
    placed: list[tuple[float, float]],
    recording: Recording,
    start: Array,
) -> Trajectory:
    """Replay a recording by the MJCF file alone.

    Args:
        path: The file.
        mechanism: The bench.
        model: What it was made of.
        placed: Sign and offset [m] of each tendon, as for `add_servo`.
        recording: Commands.
        start: Joint positions [rad] from which it starts, shape (J,).
    """
    mujoco = newton_s_mujoco()
    mj_model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(mj_model)
    places = [mj_model.joint(joint.name).qposadr[0] for joint in mechanism.joints]
    data.qpos[places] = start
    timeline = make_timeline(recording)
    fill_history(mj_model, data, timeline.command[0])
    out: dict[str, list[Any]] = {"theta": [], "rate": [], "force": [], "joints": []}
    for now, command in zip(timeline.time - timeline.time[0], timeline.command, strict=True):
        while data.time < now - 0.5 * mj_model.opt.timestep:
            mujoco.mj_step(mj_model, data)
        data.ctrl[:] = command
        mujoco.mj_forward(mj_model, data)
        out["joints"].append(data.qpos[places].copy())
        angle, rate, force = file_row(mj_model, data, mechanism, model, placed)
        out["theta"].append(angle)
        out["rate"].append(rate)
        out["force"].append(force)
    arrays = {name: np.array(values)[timeline.measured] for name, values in out.items()}
    return Trajectory(
        time=recording.time,
        motor_position=arrays["theta"],
        motor_velocity=arrays["rate"],
        force=arrays["force"],
        joint_position=arrays["joints"],
    )


def fill_history(mj_model: Any, data: Any, command: Array) -> None:
    """Let actuators with a delay begin as if a command had always been there."""
    for number_, samples in enumerate(mj_model.actuator_history[:, 0]):
        if samples:
            times = mj_model.opt.timestep * np.arange(-samples + 1.0, 1.0)
            newton_s_mujoco().mj_initCtrlHistory(
                mj_model, data, number_, times, np.full(samples, command[number_])
            )


def file_row(
    mj_model: Any,
    data: Any,
    mechanism: Mechanism,
    model: Model,
    placed: list[tuple[float, float]],
) -> tuple[list[float], list[float], list[float]]:
    """Return motor angles [rad], speeds [rad/s] and tensions [N] of MuJoCo's own state."""
    kind = int(newton_s_mujoco().mjtConstraint.mjCNSTR_FRICTION_TENDON)
    angles, rates, forces = [], [], []
    for tendon, (sign, offset) in zip(mechanism.tendons, placed, strict=True):
        number_ = mj_model.tendon(tendon.name).id
        radius = spool_of(tendon, model)
        shift = angle_shift(tendon, model, offset)
        angles.append(sign * data.ten_length[number_] / radius + shift)
        rates.append(sign * data.ten_velocity[number_] / radius)
        row = (data.efc_type == kind) & (data.efc_id == number_)
        friction = sign * float(data.efc_force[row].sum())
        force = data.actuator_force[mj_model.actuator(tendon.name).id] / radius
        first, count = mj_model.ten_J_rowadr[number_], mj_model.ten_J_rownnz[number_]
        columns = mj_model.ten_J_colind[first : first + count]
        rate_change = data.ten_J[first : first + count] @ data.qacc[columns]
        rotor = sign * mj_model.tendon_armature[number_] * rate_change
        forces.append(max(force + friction - rotor, -np.inf if tendon.direct else 0.0))
    return angles, rates, forces
