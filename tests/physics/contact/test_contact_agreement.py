"""Contact in our solver against MuJoCo's."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

from tendon_newton.data.recording import Array
from tendon_newton.mechanisms.geometry.joint_frames import ancestors
from tendon_newton.mechanisms.geometry.kinematics import posture
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.obstacles import Obstacle, Plane, Sphere
from tendon_newton.mechanisms.geometry.statics import passive_torque
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.mechanisms.worlds import build_model
from tendon_newton.simulation.hosts.tendon_solver import TendonSolver
from tests.physics.contact.bodies import ball, block, ground, marble, wall
from tests.physics.mujoco_reference import followed_in_mujoco, moved_in_mujoco, torque_of
from tests.physics.runs import ideal_model, run_of, simulate

STEP = 2.5e-4  # s
STIFF = 2.0e4  # N/m
HOLD = 2.0  # rad, short of the end stops
HELD = 58  # A row in which both are at rest


@dataclass(frozen=True, kw_only=True)
class Pair:
    """A bench that two engines move under the same commands."""

    mechanism: Mechanism
    command: Array  # [rad], shape (T, D)
    ours: Array  # Joints [rad], shape (T, J)
    theirs: Array

    def apart(self, rows: slice = slice(None)) -> Array:
        """Return how far the motions are apart (RMS), as a share of each joint's way [1], (J,)."""
        errors = (self.ours - self.theirs)[rows]
        return np.sqrt(np.mean(errors**2, axis=0)) / np.ptp(self.ours, axis=0)

    def held_torques(self, row: int) -> tuple[Array, Array]:
        """Return what contact must do to balance a bench that rests in a row [N m], (J,) each."""
        ours, theirs = (
            -passive_torque(self.mechanism, q) - torque_of(self.mechanism, q, self.command[row])
            for q in (self.ours[row], self.theirs[row])
        )
        return ours, theirs


def moved_by_both(mechanism: Mechanism, command: Array, *, bench: str, step: float) -> Pair:
    """Let both engines begin at rest and follow a command [rad], shape (T,) or (T, D)."""
    run = run_of(command, bench=bench)
    assert run.command is not None
    (ours,) = simulate([run], ideal_model(), time_step=step, mechanism=mechanism)
    theirs = followed_in_mujoco(mechanism, run.command, ours.joint_position[0], step=step)
    return Pair(mechanism=mechanism, command=run.command, ours=ours.joint_position, theirs=theirs)


def closed_on(bench: str, obstacle: Obstacle) -> Pair:
    """Let both engines close a bench on something, hold it, and open again."""
    mechanism = load_mechanism(bench).with_obstacles(obstacle)
    closing = np.linspace(0.3, HOLD, 30)
    command = np.concatenate([np.full(6, 0.3), closing, np.full(24, HOLD), np.full(10, 0.3)])
    pair = moved_by_both(mechanism, command, bench=bench, step=STEP)
    assert np.all(pair.apart() < 0.01)  # MuJoCo's contact is linear in its damping
    return pair


def held_force(mechanism: Mechanism, q: Array, torque: Array, direction: Array) -> float:
    """Return the force of a contact at the tip in a direction [N] that best gives a torque."""
    frames, tip = posture(mechanism, q), mechanism.tip
    point = frames.place(tip.body, tip.point)
    arms = np.zeros(len(q))
    for j in ancestors(mechanism.parents, tip.body):
        arms[j] = float(np.cross(frames.axis[j], point - frames.anchor[j]) @ direction)
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
    pair = closed_on("finger", obstacle(friction=0.0, stiffness=STIFF))
    torques = pair.held_torques(HELD)
    size = float(np.linalg.norm(torques[0]))
    assert size > 0.01  # N m
    assert torques[1] == pytest.approx(torques[0], abs=5e-5 * size)


def test_a_tip_on_a_floor_presses_alike() -> None:
    """The same motion, and the same resting force."""
    down = Plane(
        position=np.array([0.0, 0.0, -0.030]), normal=np.array([0.0, 0.0, 1.0]), friction=0.0
    )
    pair = closed_on("finger", down)
    forces = [
        held_force(pair.mechanism, motion[HELD], torque, down.normal)
        for motion, torque in zip((pair.ours, pair.theirs), pair.held_torques(HELD), strict=True)
    ]
    assert forces[0] > 0.5  # N
    assert forces[1] == pytest.approx(forces[0], rel=5e-5)


@pytest.mark.slow
def test_a_finger_in_space_meets_a_ball_alike() -> None:
    """Routed tendons, three joints, and a ball beside the plane in which they move."""
    sphere = Sphere(
        position=np.array([0.045, 0.004, -0.030]), radius=0.015, friction=0.0, stiffness=STIFF
    )
    pair = closed_on("finger_routed", sphere)
    assert np.linalg.norm(pair.held_torques(HELD)[0]) > 0.01  # N m


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


def both(
    mechanism: Mechanism, place: Array | list[float], speed: float = 0.0, angle: float = 0.0
) -> tuple[Array, Array]:
    """Let both engines begin with a ball somewhere that moves along x, and an open finger."""
    coordinates = np.array([0.0, 0.0, *place, 0.0, 0.0, 0.0, 1.0])
    speeds = np.array([0.0, 0.0, speed, *np.zeros(5)])
    commands = np.full((round(TIME / STEP), 1), angle)
    upright = np.roll(coordinates[5:], 1)  # MuJoCo's quaternions begin with w
    begin = np.concatenate([coordinates[:5], upright])
    return ours(mechanism, coordinates, speeds, angle), moved_in_mujoco(
        mechanism, begin, commands, step=STEP, speeds=speeds
    )


def test_a_finger_presses_a_ball_into_a_corner_alike() -> None:
    """The same ball between finger, wall and floor, and the same joints of the finger."""
    smooth = [replace(each, friction=0.0) for each in (marble(), ground(-0.037), wall(-0.0045))]
    mechanism = load_mechanism("finger").with_obstacles(*smooth)
    own, other = both(mechanism, [0.0106, 0.0, -0.022], angle=3.0)
    assert own[-1, 1] > 1.0  # rad: the finger has closed
    assert other[-1, :2] == pytest.approx(own[-1, :2], abs=1e-6)  # measured 2.7e-7
    assert other[-1, 2:5] == pytest.approx(own[-1, 2:5], abs=2e-8)  # measured 4.6e-9
