"""The nominal servo in MuJoCo, as a reference: the exported file by MuJoCo itself, and Newton's."""

from functools import partial
from pathlib import Path
from typing import Any

import mujoco
import newton
import numpy as np
from newton.solvers import SolverMuJoCo

from tendon_newton.data.recording import Array, Recording
from tendon_newton.mechanisms.authoring.mujoco_file import write_mujoco
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.parts import Tendon, excursion, moment_arms
from tendon_newton.mechanisms.worlds import build_model
from tendon_newton.simulation.model.mechanism_arrays import joint_places
from tests.physics.runs import GAIN, RADIUS, ROWS, replayed

# Newton's ``solref_mode`` in which stiffness and damping of a shape are [N/m] and [N s/m]
FORCE_SPACE = 0
# MuJoCo's `solimp` with which a contact is a spring and a damper also in motion; by its default it
# gives way as if the link were as heavy as a body, and lets light links pass
SOFTNESS = (0.01, 0.01, 1.0e-3, 0.5, 2.0)
SLIP_RATIO = 1.0e4  # MuJoCo's ``impratio`` [1]: how much less friction creeps than a contact gives


def moved_by_the_file(
    mechanism: Mechanism, run: Recording, start: Array, *, step: float, folder: Path
) -> Array:
    """Return the joints in each row [rad, m], (T, J), as MuJoCo moves the mechanism's MJCF.

    Motors pull on MuJoCo's own tendons, whose lengths it reckons by itself. A mechanism rests at
    the start (J,). Rows must be whole steps apart.
    """
    write_mujoco(folder / "mechanism.xml", mechanism)
    model = mujoco.MjModel.from_xml_path(str(folder / "mechanism.xml"))
    model.opt.timestep = step
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)  # all joints at 0
    straight = np.array(data.actuator_length)
    offset, radius = np.transpose(
        [(tendon.excursion_offset, radius_of(tendon)) for tendon in mechanism.tendons]
    )
    data.qpos[:] = start
    rows = [np.array(data.qpos)]
    assert run.command is not None
    for command in run.command[:-1]:
        for _ in range(round(1.0 / (ROWS * step))):
            mujoco.mj_step1(model, data)
            wound = offset + data.actuator_length - straight
            data.ctrl[:] = GAIN * (command - wound / radius)  # a motor has its limits
            mujoco.mj_step2(model, data)
        rows.append(np.array(data.qpos))
    return np.array(rows)


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


def moved_by_newton(
    mechanism: Mechanism,
    coordinates: Array,
    speeds: Array,
    commands: Array,
    *,
    step: float,
) -> Array:
    """Return the coordinates at the end of each step of Newton's SolverMuJoCo, shape (S, C).

    Contacts come from Newton's collision pipeline. `commands` are the servos' angles in each
    step [rad], shape (S, D).
    """
    model: Any = build_model(mechanism, 1, device="cpu")
    contacts, solver = NewtonContacts(model), solver_with_contacts(model)
    own, forces = (places.numpy()[0] for places in joint_places(model))
    states: Any = [model.state(), model.state()]
    states[0].joint_q.assign(coordinates.astype(np.float32))
    states[0].joint_qd.assign(speeds.astype(np.float32))
    control: Any = model.control()

    def advance(begin: Any, end: Any) -> None:
        solver.step(begin, end, control, contacts.find(begin), step)

    steps = [replayed(partial(advance, *ends)) for ends in (states, states[::-1])]
    rows, torque = [coordinates], np.zeros(len(speeds), dtype=np.float32)
    for number, command in enumerate(commands):
        torque[forces] = torque_of(mechanism, rows[-1][own], command)
        control.joint_f.assign(torque)
        steps[number % 2]()
        rows.append(states[(number + 1) % 2].joint_q.numpy().astype(np.float64))
    return np.array(rows[1:])


class NewtonContacts:
    """Contacts of a model's links with its obstacles; none where it has no obstacles.

    Newton's stiffness per shape is that of ours. By MuJoCo's priorities one material of two counts:
    that of an obstacle before that of a link which is one, and that before another link's.
    """

    def __init__(self, model: Any) -> None:
        own = model.mujoco
        modes, ranks, given = (
            array.numpy() for array in (own.solref_mode, own.geom_priority, own.geom_solimp)
        )
        shapes = [model.tendon.obstacle_shape.numpy(), model.tendon.bone_shape.numpy()]
        modes[np.concatenate(shapes)] = FORCE_SPACE
        count = len(shapes[0])
        order = count - np.arange(count)  # the first counts between two links
        ranks[shapes[0]] = np.where(np.isin(shapes[0], shapes[1]), order, count + 1)
        given[shapes[0]] = SOFTNESS
        own.solref_mode.assign(modes)
        own.geom_priority.assign(ranks)
        own.geom_solimp.assign(given)
        self._pipeline = newton.CollisionPipeline(model)
        self._found = self._pipeline.contacts()

    def find(self, state: newton.State) -> newton.Contacts:
        """Return the contacts of a state; the same object every time."""
        self._pipeline.collide(state, self._found)
        return self._found


def solver_with_contacts(model: Any) -> SolverMuJoCo:
    """Return a solver which takes Newton's contacts."""
    return SolverMuJoCo(model, use_mujoco_contacts=False, cone="elliptic", impratio=SLIP_RATIO)
