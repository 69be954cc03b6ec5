"""Contact in our solver against Newton's SolverMuJoCo with Newton's collision pipeline."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest

from tendon_newton.data.recording import Array
from tendon_newton.mechanisms.geometry.joint_frames import ancestors
from tendon_newton.mechanisms.geometry.kinematics import posture
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.obstacles import Obstacle, Plane, Sphere
from tendon_newton.mechanisms.geometry.parts import moment_arms
from tendon_newton.mechanisms.geometry.statics import passive_torque
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.mechanisms.worlds import build_model
from tendon_newton.simulation.hosts.rollout import Trajectory
from tendon_newton.simulation.hosts.tendon_solver import TendonSolver
from tendon_newton.simulation.mujoco.mujoco_rollout import (
    MujocoContacts,
    MujocoRollout,
    solver_with_contacts,
)
from tests.physics.contact.bodies import ball, block, ground, marble, wall
from tests.physics.runs import GAIN, ideal_model, replayed, run_of, simulate
from tests.physics.runs import RADIUS as SPOOL

STEP = 2.5e-4  # s
STIFF = 2.0e4  # N/m
HOLD = 2.0  # rad, short of the end stops
HELD = 58  # A row in which both are at rest


def closing_pair(bench: str, obstacle: Obstacle) -> tuple[Mechanism, Trajectory, Trajectory]:
    """Let both engines close a bench on something, hold it, and open again."""
    mechanism = load_mechanism(bench).with_obstacles(obstacle)
    closing = np.linspace(0.3, HOLD, 30)
    commands = np.concatenate([np.full(6, 0.3), closing, np.full(24, HOLD), np.full(10, 0.3)])
    runs = [run_of(commands, bench=bench)]
    (ours,) = simulate(runs, ideal_model(), time_step=STEP, mechanism=mechanism)
    rollout = MujocoRollout(mechanism, runs, ideal_model(), time_step=STEP, device="cpu")
    (theirs,) = rollout.run()
    return mechanism, ours, theirs


def check_alike(ours: Trajectory, theirs: Trajectory) -> None:
    """Compare two motions, by the range that they move through."""
    reach = np.ptp(ours.joint_position, axis=0)
    apart = np.sqrt(np.mean((ours.joint_position - theirs.joint_position) ** 2, axis=0))
    assert np.all(apart < 0.01 * reach)  # MuJoCo's contact is linear in its damping


def held_torque(mechanism: Mechanism, run: Trajectory, row: int) -> Array:
    """Return what contact must do for a bench at rest in a row to be in balance [N m], (J,)."""
    q = run.joint_position[row]
    torque = passive_torque(mechanism, q)
    for tendon, tension in zip(mechanism.tendons, run.force[row], strict=True):
        torque = torque + moment_arms(tendon, q) * tension
    return -torque


def held_force(mechanism: Mechanism, run: Trajectory, row: int, direction: Array) -> float:
    """Return the force of a contact at the tip in a direction [N] that best balances a row."""
    q = run.joint_position[row]
    frames, tip = posture(mechanism, q), mechanism.tip
    point = frames.place(tip.body, tip.point)
    arms = np.zeros(len(q))
    for j in ancestors(mechanism.parents, tip.body):
        arms[j] = float(np.cross(frames.axis[j], point - frames.anchor[j]) @ direction)
    torque = held_torque(mechanism, run, row)
    return float(arms @ torque / (arms @ arms))


@pytest.mark.parametrize(
    "obstacle",
    [
        pytest.param(ball, id="ball"),
        pytest.param(block, id="block", marks=pytest.mark.slow),  # compiles for half a minute
    ],
)
def test_a_closing_finger_meets_an_obstacle_alike(obstacle: Callable[..., Obstacle]) -> None:
    """The same way in, the same hold, the same way out, and the same torques while it lasts."""
    mechanism, ours, theirs = closing_pair("finger", obstacle(friction=0.0, stiffness=STIFF))
    check_alike(ours, theirs)
    torques = [held_torque(mechanism, run, HELD) for run in (ours, theirs)]
    size = float(np.linalg.norm(torques[0]))
    assert size > 0.01  # N m
    assert torques[1] == pytest.approx(torques[0], abs=0.005 * size)


def test_a_tip_on_a_floor_presses_alike() -> None:
    """The same motion, and the same resting force."""
    down = Plane(
        position=np.array([0.0, 0.0, -0.030]), normal=np.array([0.0, 0.0, 1.0]), friction=0.0
    )
    mechanism, ours, theirs = closing_pair("finger", down)
    check_alike(ours, theirs)
    forces = [held_force(mechanism, run, HELD, down.normal) for run in (ours, theirs)]
    assert forces[0] > 0.5  # N
    assert forces[1] == pytest.approx(forces[0], rel=0.005)


@pytest.mark.slow
def test_a_finger_in_space_meets_a_ball_alike() -> None:
    """Routed tendons, three joints, and a ball beside the plane in which they move."""
    sphere = Sphere(
        position=np.array([0.045, 0.004, -0.030]), radius=0.015, friction=0.0, stiffness=STIFF
    )
    mechanism, ours, theirs = closing_pair("finger_routed", sphere)
    check_alike(ours, theirs)
    assert np.linalg.norm(held_torque(mechanism, ours, HELD)) > 0.01  # N m


ARMS = np.array([0.0080, 0.0055])  # m

TIME = 0.3  # s


def ours(mechanism: Mechanism, coordinates: Array, speeds: Array, angle: float = 0.0) -> Array:
    """Return the joints and the body's pose at the end of each step of our solver.

    Args:
        angle: What the servo is asked for [rad].
    """
    model = build_model(mechanism, 1, device="cpu")
    solver = TendonSolver(model, ideal_model(), max_step=STEP, update_bodies=False)
    state: Any = model.state()
    state.joint_q.assign(coordinates.astype(np.float32))
    state.joint_qd.assign(speeds.astype(np.float32))
    solver.command.fill_(angle)
    solver.reset(state)
    rows = []
    for _ in range(round(TIME / STEP)):
        solver.step(state, state, None, None, STEP)
        rows.append(state.joint_q.numpy().astype(np.float64))
    return np.array(rows)


def theirs(mechanism: Mechanism, coordinates: Array, speeds: Array, angle: float = 0.0) -> Array:
    """Return the same of SolverMuJoCo, whose joints get the torque of the tendon."""
    model = build_model(mechanism, 1, device="cpu")
    contacts, solver = MujocoContacts(model), solver_with_contacts(model)
    states: Any = [model.state(), model.state()]
    states[0].joint_q.assign(coordinates.astype(np.float32))
    states[0].joint_qd.assign(speeds.astype(np.float32))
    control: Any = model.control()

    def step(begin: Any, end: Any) -> None:
        solver.step(begin, end, control, contacts.find(begin), STEP)

    steps = [replayed(partial(step, *ends)) for ends in (states, states[::-1])]
    rows, torque = [coordinates], np.zeros(len(speeds), dtype=np.float32)
    for number in range(round(TIME / STEP)):
        wound = ARMS @ rows[-1][:2]
        torque[:2] = ARMS * max(0.0, GAIN * (angle - wound / SPOOL))
        control.joint_f.assign(torque)
        steps[number % 2]()
        rows.append(states[(number + 1) % 2].joint_q.numpy().astype(np.float64))
    return np.array(rows[1:])


def both(
    mechanism: Mechanism, place: Array | list[float], speed: float = 0.0, angle: float = 0.0
) -> tuple[Array, Array]:
    """Let both engines begin with a ball somewhere that moves along x, and an open finger."""
    coordinates = np.array([0.0, 0.0, *place, 0.0, 0.0, 0.0, 1.0])
    speeds = np.array([0.0, 0.0, speed, *np.zeros(5)])
    return ours(mechanism, coordinates, speeds, angle), theirs(
        mechanism, coordinates, speeds, angle
    )


def test_a_finger_presses_a_ball_into_a_corner_alike() -> None:
    """The same ball between finger, wall and floor, and the same joints of the finger."""
    smooth = [replace(each, friction=0.0) for each in (marble(), ground(-0.037), wall(-0.0045))]
    mechanism = load_mechanism("finger").with_obstacles(*smooth)
    own, other = both(mechanism, [0.0106, 0.0, -0.022], angle=3.0)
    assert own[-1, 1] > 1.0  # rad: the finger has closed
    assert other[-1, :2] == pytest.approx(own[-1, :2], abs=5e-5)  # measured 1.3e-5
    assert other[-1, 2:5] == pytest.approx(own[-1, 2:5], abs=1e-6)  # measured 2e-7
