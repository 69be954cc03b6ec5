"""Obstacles, and contact by hand, for the tests of physics."""

import numpy as np

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
