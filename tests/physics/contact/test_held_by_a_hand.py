"""Four fingers around one ball: what one does to it, the others feel."""

from functools import cache

import numpy as np
import pytest
import torch
from torch import Tensor

from tendon_newton.data.recording import Array
from tendon_newton.mechanisms.geometry.obstacles import STIFFNESS, Plane, Sphere
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.simulation.hosts.control_loop import ControlLoop
from tests.physics.contact.bodies import GRAVITY, MASS, RATE, STEP, ground, later
from tests.physics.runs import ideal_model

pytestmark = pytest.mark.slow

RADIUS = 0.02  # m
WORLDS = 3
BALL, PALM, FLOOR = range(3)
FINGERS = 4
FACE = -0.008  # Where the palm's face is along the fingers [m]
TIPPED = 0.25  # By how much the palm's face leans over what is below the fingers [rad]


@cache
def hand() -> ControlLoop:
    """Return hands over a ball, a palm that leans over it, and a floor."""
    ball = Sphere(position=np.array([0.035, 0.0, -0.040]), radius=RADIUS, mass=MASS, friction=0.8)
    lean = np.array([np.cos(TIPPED), 0.0, np.sin(TIPPED)])
    palm = Plane(position=np.array([FACE, 0.0, -0.010]), normal=lean, friction=0.8)
    mechanism = load_mechanism("hand").with_obstacles(ball, palm, ground(-0.06))
    return ControlLoop(mechanism, ideal_model(), WORLDS, rate=RATE, max_step=STEP, device="cpu")


def fresh() -> ControlLoop:
    """Return the hands with nominal numbers."""
    loop = hand()
    loop.solver.notify_model_changed(1)
    return loop


def asked(*angles: float) -> Tensor:
    """Return the commands of four fingers [rad], the same in all worlds."""
    return torch.tensor(angles).repeat(WORLDS, 1)


def at(place: list[float]) -> Tensor:
    """Return one place of all worlds' balls."""
    return torch.tensor([*place, 0.0, 0.0, 0.0, 1.0]).repeat(WORLDS, 1)


def pushes(loop: ControlLoop) -> Array:
    """Return what each finger does to the first world's ball [N], shape (4, 3)."""
    force = -loop.contact_forces()[0, :, BALL].numpy().astype(np.float64)
    return force.reshape(FINGERS, -1, 3).sum(axis=1)


def test_a_hand_is_stepped_as_four_fingers_that_share_a_ball() -> None:
    """Kernels of one finger; its ball's coordinates stand behind those of the hand."""
    loop = fresh()
    assert loop.solver.chain_count == FINGERS
    assert loop.body_pose.shape == (WORLDS, 7)
    assert loop.bench_numbers("obstacle_position").shape == (WORLDS, 3, 3)


def close(loop: ControlLoop, steps: int) -> None:
    """Let all fingers close on the ball that lies on the floor."""
    loop.reset(asked(*[0.0] * FINGERS))
    for step in range(steps):
        loop.step(asked(*[min(4.0, 0.02 * step)] * FINGERS))


def test_what_one_finger_does_to_a_ball_another_feels() -> None:
    """Two fingers press a ball into the palm. One lets go: the ball gives way below the other.

    The two that do not touch the ball feel nothing.
    """
    loop = fresh()
    close(loop, 350)
    assert float(loop.body_velocity.abs().max()) < 1e-6  # all rest
    before, joints = pushes(loop), loop.reading.joint_position[0].clone().reshape(FINGERS, -1)
    assert np.linalg.norm(before[2:], axis=-1) == pytest.approx([1.84, 2.11], rel=0.05)
    later(loop, 200, asked(4.0, 4.0, 4.0, 0.0))
    after = pushes(loop)
    moved = (loop.reading.joint_position[0].reshape(FINGERS, -1) - joints).abs().amax(dim=-1)
    assert np.linalg.norm(after[3]) == 0.0
    assert np.linalg.norm(after[2] - before[2]) > 0.05  # N
    assert float(moved[2]) > 1e-3  # rad
    assert float(moved[:2].max()) < 1e-6  # rad


def test_a_hand_holds_a_ball_that_loses_its_floor() -> None:
    """Finger and palm bear its weight, at rest; balls of 50, 20 and 10 g alike."""
    loop = fresh()
    loop.bench_numbers("body_mass")[1] = 0.02
    loop.bench_numbers("body_mass")[2] = 0.01
    close(loop, 400)
    loop.bench_numbers("obstacle_stiffness")[:, FLOOR] = 0.0
    later(loop, 400, asked(*[4.0] * FINGERS))
    assert not loop.reading.diverged.any()
    assert float(loop.body_velocity.abs().max()) < 1e-6
    place = loop.body_pose[0, :3].numpy().astype(np.float64)
    normal = loop.bench_numbers("obstacle_rotation")[0, PALM, :, 2].numpy()
    point = loop.bench_numbers("obstacle_position")[0, PALM].numpy()
    push = STIFFNESS * (RADIUS - float((place - point) @ normal))
    weight = np.array([0.0, 0.0, -MASS * GRAVITY])
    left = pushes(loop).sum(axis=0) + weight + push * normal
    assert push > 0.5  # N
    assert left @ normal == pytest.approx(0.0, abs=2e-3)  # N; 4e-9 m of float32 are 2e-5 N
    assert np.linalg.norm(left) < 0.8 * push  # the palm's friction bears this
