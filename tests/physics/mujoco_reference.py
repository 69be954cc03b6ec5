"""The nominal servo in MuJoCo itself, as a reference: a mechanism as its MJCF file moves there."""

import tempfile
from pathlib import Path

import mujoco
import numpy as np

from tendon_newton.data.recording import Array
from tendon_newton.mechanisms.authoring.mujoco_contacts import IMPEDANCE
from tendon_newton.mechanisms.authoring.mujoco_file import write_mujoco
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.parts import Tendon, excursion, moment_arms
from tests.physics.runs import GAIN, RADIUS, ROWS

# MuJoCo's `solimp` with which a contact is a spring and a damper also in motion
SOFT = 0.01
SOFTNESS = (SOFT, SOFT, 1.0e-3, 0.5, 2.0)
SLIP_RATIO = 1.0e4  # MuJoCo's ``impratio`` [1]: how much less friction creeps than a contact gives


def moved_in_mujoco(
    mechanism: Mechanism,
    coordinates: Array,
    commands: Array,
    *,
    step: float,
    speeds: Array | float = 0.0,
) -> Array:
    """Return the coordinates at the end of each step, shape (S, C).

    Motors pull on MuJoCo's own tendons, whose lengths it reckons by itself, and it finds the
    contacts of the file by itself too. These are springs and dampers as stiff as there; at the
    file's own impedance MuJoCo lets the links' weight decide as well.

    Args:
        mechanism: What moves.
        coordinates: Where it begins [rad, m], shape (C,): its joints, and the place and quaternion
            (w, x, y, z) of a body.
        commands: The servos' angles in each step [rad], shape (S, D).
        step: Length of a step [s].
        speeds: With which it begins.
    """
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "mechanism.xml"
        write_mujoco(path, mechanism)
        model = mujoco.MjModel.from_xml_path(str(path))
    model.opt.timestep, model.opt.impratio = step, SLIP_RATIO
    model.pair_solref[:] *= (1.0 - SOFT) / (1.0 - IMPEDANCE)
    model.pair_solimp[:] = SOFTNESS
    model.pair_solreffriction[:] = 0.0  # friction is as quick as the push
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)  # all joints at 0
    straight = np.array(data.actuator_length)
    offset, radius = np.transpose(
        [(tendon.excursion_offset, radius_of(tendon)) for tendon in mechanism.tendons]
    )
    data.qpos[:], data.qvel[:] = coordinates, speeds
    rows = []
    for command in commands:
        mujoco.mj_step1(model, data)
        wound = offset + data.actuator_length - straight
        data.ctrl[:] = GAIN * (command - wound / radius)  # a motor has its limits
        mujoco.mj_step2(model, data)
        rows.append(np.array(data.qpos))
    return np.array(rows)


def followed_in_mujoco(mechanism: Mechanism, command: Array, start: Array, *, step: float) -> Array:
    """Return the joints in each row of a command (T, D) [rad], from rest at the start (J,)."""
    each = round(1.0 / (ROWS * step))
    moved = moved_in_mujoco(mechanism, start, np.repeat(command[:-1], each, axis=0), step=step)
    return np.vstack([start, moved[each - 1 :: each]])


def radius_of(tendon: Tendon) -> float:
    """Return the radius [m] by which a tendon's servo winds it in; 1 where it turns a shaft."""
    return 1.0 if tendon.direct else RADIUS


def torque_of(mechanism: Mechanism, q: Array, command: Array) -> Array:
    """Return what the tendons do to the joints at positions (J,), [N m] or [N], shape (J,)."""
    torque = np.zeros(len(q))
    for tendon, angle in zip(mechanism.tendons, command, strict=True):
        pull = GAIN * (angle - excursion(tendon, q) / radius_of(tendon))
        least = -tendon.force_limit if tendon.direct else 0.0
        torque += moment_arms(tendon, q) * np.clip(pull, least, tendon.force_limit)
    return torque
