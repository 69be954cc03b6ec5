"""A ball and a block that move, and where they begin, for the tests of physics."""

from functools import cache

import numpy as np
import torch
from torch import Tensor

from tendon_newton.data.recording import Array
from tendon_newton.mechanisms.geometry.joint_frames import ancestors
from tendon_newton.mechanisms.geometry.kinematics import posture
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.obstacles import (
    FRICTION,
    STIFFNESS,
    Box,
    Obstacle,
    Plane,
    Sphere,
)
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.simulation.hosts.control_loop import ControlLoop
from tests.physics.runs import ideal_model

GRAVITY = 9.81  # m/s2
MASS = 0.05  # kg
RADIUS = 0.015  # m
HALF = np.array([0.010, 0.015, 0.020])  # m
FAR = 0.2  # m, beyond the finger's reach
RATE = 200.0  # Hz
STEP = 5.0e-4  # s
WORLDS = 2
BODY, FLOOR, WALL = range(3)
SINK = MASS * GRAVITY / STIFFNESS  # How deep what moves sinks into what bears it at one point [m]


def marble(*, friction: float = FRICTION) -> Sphere:
    """Return a ball that moves."""
    return Sphere(position=np.array([FAR, 0.0, 0.1]), radius=RADIUS, mass=MASS, friction=friction)


def brick() -> Box:
    """Return a block that moves, with three different edges."""
    return Box(position=np.array([FAR, 0.0, 0.1]), half_size=HALF, mass=MASS)


def ground(height: float = -0.1) -> Plane:
    """Return a level floor."""
    return Plane(position=np.array([0.0, 0.0, height]), normal=np.array([0.0, 0.0, 1.0]))


def wall(place: float = -0.1) -> Plane:
    """Return a wall that looks along +x."""
    return Plane(position=np.array([place, 0.0, 0.0]), normal=np.array([1.0, 0.0, 0.0]))


def scene_of(body: Sphere | Box) -> Mechanism:
    """Return a finger, what moves, a floor and a wall."""
    return load_mechanism("finger").with_obstacles(body, ground(), wall())


@cache
def loop_of(shape: str, step: float) -> ControlLoop:
    """Return two worlds with a body, a floor and a wall."""
    body = marble() if shape == "sphere" else brick()
    return ControlLoop(
        scene_of(body), ideal_model(), WORLDS, rate=RATE, max_step=step, device="cpu"
    )


def fresh(shape: str, *, step: float = STEP, **materials: float) -> ControlLoop:
    """Return the worlds with nominal numbers, and some materials of all that is in them."""
    loop = loop_of(shape, step)
    loop.solver.notify_model_changed(1)
    for name, value in materials.items():
        loop.bench_numbers(f"obstacle_{name}").fill_(value)
    return loop


def command(angle: float = 0.0) -> Tensor:
    """Return one command [rad] for all worlds."""
    return torch.full((WORLDS, 1), angle)


def pose(place: Array | list[float], turn: Array | None = None) -> Tensor:
    """Return a place [m] and a quaternion of all worlds' bodies."""
    quaternion = np.array([0.0, 0.0, 0.0, 1.0]) if turn is None else turn
    return torch.tensor(np.tile([*place, *quaternion], (WORLDS, 1)), dtype=torch.float32)


def speeds(*values: float) -> Tensor:
    """Return velocity [m/s] and angular velocity [rad/s] of all worlds' bodies."""
    return torch.tensor(values, dtype=torch.float32).repeat(WORLDS, 1)


def motion(loop: ControlLoop, world: int = 0) -> tuple[Array, Array]:
    """Return pose and velocity of a world's body."""
    return (
        loop.body_pose[world].numpy().astype(np.float64),
        loop.body_velocity[world].numpy().astype(np.float64),
    )


def later(loop: ControlLoop, steps: int, asked: Tensor | None = None) -> ControlLoop:
    """Return worlds after some steps under one command [rad], none by default."""
    for _ in range(steps):
        loop.step(command() if asked is None else asked)
    return loop


def tilt_floor(loop: ControlLoop, angle: float) -> tuple[Array, Array]:
    """Tilt the floor about +y; return its normal and the way down."""
    sine, cosine = np.sin(angle), np.cos(angle)
    turned = np.array([[cosine, 0.0, sine], [0.0, 1.0, 0.0], [-sine, 0.0, cosine]])
    loop.bench_numbers("obstacle_rotation")[:, FLOOR] = torch.tensor(turned)
    return turned[:, 2], turned[:, 0]


BONES = {"finger": ((0.0, 0.030, 0.0040), (0.0, 0.025, 0.0035))}
"""Where the capsules of a bench begin and end along their links, and their radii [m]."""


def ball(*, friction: float = FRICTION, stiffness: float = STIFFNESS) -> Sphere:
    """Return a ball in the palm that both phalanges close on."""
    return Sphere(
        position=np.array([0.016, 0.001, -0.020]),
        radius=0.012,
        friction=friction,
        stiffness=stiffness,
    )


def block(*, friction: float = FRICTION, stiffness: float = STIFFNESS) -> Box:
    """Return a block whose upper face the tip meets."""
    return Box(
        position=np.array([0.040, 0.002, -0.045]),
        half_size=np.array([0.015, 0.020, 0.012]),
        friction=friction,
        stiffness=stiffness,
    )


def floor(*, friction: float = FRICTION, stiffness: float = STIFFNESS) -> Plane:
    """Return a floor under the finger, tilted out of its plane too."""
    return Plane(
        position=np.array([0.0, 0.0, -0.030]),
        normal=np.array([0.1, 0.05, 1.0]),
        friction=friction,
        stiffness=stiffness,
    )


def distances(obstacle: Obstacle, points: Array) -> Array:
    """Return how far points, shape (N, 3), are from an obstacle [m], by hand."""
    local = (points - obstacle.position) @ obstacle.rotation
    if obstacle.shape == "sphere":
        return np.linalg.norm(local, axis=-1) - obstacle.size[0]
    if obstacle.shape == "plane":
        return local[:, 2]
    over = np.abs(local) - obstacle.size
    outside = np.linalg.norm(np.maximum(over, 0.0), axis=-1)
    return outside + np.minimum(np.max(over, axis=-1), 0.0)


def deepest(obstacle: Obstacle, start: Array, end: Array, radius: float, count: int) -> float:
    """Return the greatest depth of a capsule in an obstacle [m], among points of its axis."""
    points = start + np.linspace(0.0, 1.0, count)[:, None] * (end - start)
    return radius - float(np.min(distances(obstacle, points)))


def ball_torque(mechanism: Mechanism, sphere: Sphere, q: Array) -> tuple[Array, Array]:
    """Return the torques of a smooth ball at rest [N m], (J,), and its push on each bone [N]."""
    frames = posture(mechanism, q)
    torque, push = np.zeros(len(q)), []
    for link, (begin, end, radius) in enumerate(BONES[mechanism.name]):
        forward = frames.rotation[link] @ np.array([1.0, 0.0, 0.0])
        at = frames.position[link] + begin * forward
        along = np.clip((sphere.position - at) @ forward, 0.0, end - begin)
        nearest = at + along * forward
        away = nearest - sphere.position
        distance = float(np.linalg.norm(away))
        force = sphere.stiffness * max(0.0, sphere.radius + radius - distance)
        push.append(force)
        for joint in ancestors(mechanism.parents, link):
            move = np.cross(frames.axis[joint], nearest - frames.anchor[joint])
            torque[joint] += force * float(move @ away) / distance
    return torque, np.array(push)
