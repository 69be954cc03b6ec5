"""Newton's SolverMuJoCo as a reference: its joints get the torque of ideal servos, by numpy."""

from collections.abc import Callable
from functools import partial
from typing import Any

import newton
import numpy as np
from newton.solvers import SolverMuJoCo

from tendon_newton.data.recording import Array, Recording
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.parts import excursion, moment_arms
from tendon_newton.mechanisms.worlds import build_model
from tendon_newton.simulation.hosts.rollout import Trajectory
from tendon_newton.simulation.model.mechanism_arrays import joint_places
from tests.physics.runs import GAIN, RADIUS, replayed

# Newton's ``solref_mode`` in which stiffness and damping of a shape are [N/m] and [N s/m]
FORCE_SPACE = 0
# MuJoCo's `solimp` with which a contact is a spring and a damper also in motion; by its default it
# gives way as if the link were as heavy as a body, and lets light links pass
SOFTNESS = (0.01, 0.01, 1.0e-3, 0.5, 2.0)
SLIP_RATIO = 1.0e4  # MuJoCo's ``impratio`` [1]: how much less friction creeps than a contact gives


def pulls(mechanism: Mechanism, q: Array, command: Array) -> Array:
    """Return what ideal servos pull with [N], or turn a shaft with [N m], shape (D,)."""
    out = []
    for tendon, angle in zip(mechanism.tendons, command.astype(np.float64), strict=True):
        radius = 1.0 if tendon.direct else float(np.float32(RADIUS))
        least = -tendon.force_limit if tendon.direct else 0.0
        asked = GAIN * (angle - excursion(tendon, q) / radius)
        out.append(np.clip(asked, least, tendon.force_limit))
    return np.array(out)


def torques(mechanism: Mechanism, q: Array, command: Array) -> Array:
    """Return what these servos do to the joints [N m, N], shape (J,)."""
    arms = np.array([moment_arms(tendon, q) for tendon in mechanism.tendons])
    return pulls(mechanism, q, command) @ arms


def mujoco_steps(
    mechanism: Mechanism,
    coordinates: Array,
    speeds: Array,
    command: Callable[[int], Array],
    steps: int,
    step: float,
) -> Array:
    """Return Newton's coordinates at the start and at the end of each step, shape (N + 1, ...).

    Args:
        coordinates: Those of the joints in their order, and the pose of a body behind them.
        speeds: Their rates.
        command: Angles that the servos are asked for in a step [rad], shape (D,).
    """
    model = build_model(mechanism, 1, device="cpu")
    find, solver = contacts_of(model), solver_with_contacts(model)
    places, rates = (each.numpy().ravel() for each in joint_places(model))
    states: Any = [model.state(), model.state()]
    for state in states:
        state.joint_q.assign(coordinates.astype(np.float32))
        state.joint_qd.assign(speeds.astype(np.float32))
        newton.eval_fk(model, state.joint_q, state.joint_qd, state)
    control: Any = model.control()

    def advance(begin: Any, end: Any) -> None:
        solver.step(begin, end, control, find(begin), step)

    both = [replayed(partial(advance, *ends)) for ends in (states, states[::-1])]
    rows, torque = [coordinates], np.zeros(len(speeds), dtype=np.float32)
    for number in range(steps):
        torque[rates] = torques(mechanism, rows[-1][places], command(number))
        control.joint_f.assign(torque)
        both[number % 2]()
        rows.append(states[(number + 1) % 2].joint_q.numpy().astype(np.float64))
    return np.array(rows)


def mujoco_run(mechanism: Mechanism, run: Recording, ours: Trajectory, step: float) -> Trajectory:
    """Return what SolverMuJoCo makes of a run of commands from where ours begins, row by row."""
    per_row = round((run.time[1] - run.time[0]) / step)
    assert run.command is not None
    commands, count = run.command, len(run.time)
    places = joint_places(build_model(mechanism, 1, device="cpu"))[0].numpy().ravel()
    start = np.zeros(len(places))
    start[places] = ours.joint_position[0]
    found = mujoco_steps(
        mechanism, start, 0.0 * start, lambda n: commands[n // per_row], (count - 1) * per_row, step
    )[::per_row]
    joints = found[:, places]
    force = np.array([pulls(mechanism, q, c) for q, c in zip(joints, commands, strict=True)])
    angle = np.array([[excursion(t, q) / RADIUS for t in mechanism.tendons] for q in joints])
    return Trajectory(
        time=run.time, motor_position=angle, motor_velocity=0.0 * angle, force=force,
        joint_position=joints,
    )  # fmt: skip


def contacts_of(model: Any) -> Callable[[newton.State], newton.Contacts | None]:
    """Return what finds the contacts of a model's links with its obstacles; the same object always.

    Newton's stiffness per shape is that of ours. Damping is linear, as much as ours at a
    newton (`obstacle_shapes.USUAL_FORCE`). By MuJoCo's priorities one material of two counts: that
    of an obstacle before that of a link which is one, and that before another link's.
    """
    if not hasattr(model.tendon, "obstacle_shape"):
        return lambda state: None
    own = model.mujoco
    modes, ranks, given = (
        array.numpy() for array in (own.solref_mode, own.geom_priority, own.geom_solimp)
    )
    shapes = [model.tendon.obstacle_shape.numpy(), model.tendon.bone_shape.numpy()]
    modes[np.concatenate(shapes)] = FORCE_SPACE
    order = len(shapes[0]) - np.arange(len(shapes[0]))  # the first counts between two links
    ranks[shapes[0]] = np.where(np.isin(shapes[0], shapes[1]), order, len(shapes[0]) + 1)
    given[shapes[0]] = SOFTNESS
    own.solref_mode.assign(modes)
    own.geom_priority.assign(ranks)
    own.geom_solimp.assign(given)
    pipeline = newton.CollisionPipeline(model)
    found = pipeline.contacts()

    def find(state: newton.State) -> newton.Contacts:
        pipeline.collide(state, found)
        return found

    return find


def solver_with_contacts(model: Any) -> SolverMuJoCo:
    """Return a solver for a model, which takes contacts where it has obstacles."""
    if not hasattr(model.tendon, "obstacle_shape"):
        return SolverMuJoCo(model, disable_contacts=True)
    return SolverMuJoCo(model, use_mujoco_contacts=False, cone="elliptic", impratio=SLIP_RATIO)
