"""A motion of an arm, replayed by a MuJoCo model whose servos are its own actuators."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from tendon_newton.arms.arm import ArmMotion
from tendon_newton.data.recording import Array
from tendon_newton.exports.mujoco.mjcf_servo import fill_history
from tendon_newton.mechanisms.authoring.mujoco_file import newton_s_mujoco
from tendon_newton.simulation.hosts.timeline import make_timeline


def motion_rows(motion: ArmMotion) -> dict[str, Any]:
    """Return what a program needs of a motion, and which of its rows were measured."""
    lines = [make_timeline(recording) for recording in motion.recordings]
    longest = max(lines, key=lambda line: len(line.time))  # some joints have a row before the first
    rows = len(longest.time)
    told = [np.pad(line.command[:, 0], (rows - len(line.time), 0), "edge") for line in lines]
    out: dict[str, Any] = {
        "t": longest.time,
        "theta_d": np.column_stack(told),
        "measured": longest.measured,
    }
    if motion.recordings[0].start == "first_row":
        out["start"] = motion.angles[0]
    return out


def angles_of(
    model: Any, motion: ArmMotion, joints: Sequence[str], sign: Array, zero: Array
) -> Array:
    """Replay a motion by the springs of a MuJoCo model, an actuator on each joint in their order.

    A joint stands at sign * angle + zero.

    Args:
        joints: Names of the model's joints, in the order of the arm's.
        sign: Shape (J,).
        zero: [rad], shape (J,).

    Returns:
        What the encoders report [rad], shape (T, J).
    """
    told = motion_rows(motion)
    command, times = told["theta_d"], told["t"] - told["t"][0]
    places = [int(model.joint(name).qposadr[0]) for name in joints]
    first = sign * told.get("start", command[0]) + zero
    rows = [sign * (q[places] - zero) for q in positions(model, command, times, places, first)]
    return np.array(rows)[told["measured"]]


def positions(
    model: Any, command: Array, times: Array, places: Sequence[int], first: Array
) -> Iterator[Array]:
    """Yield a MuJoCo model's positions at each row's instant [s], from the first ones [rad]."""
    mujoco = newton_s_mujoco()
    data = mujoco.MjData(model)
    data.qpos[places] = first
    fill_history(model, data, command[0])
    for asked, end in zip(command, np.append(times[1:], times[-1]), strict=True):
        data.ctrl[:] = asked
        yield data.qpos.copy()
        while data.time < end - 0.5 * model.opt.timestep:
            mujoco.mj_step(model, data)
