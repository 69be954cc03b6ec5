"""Where the plant rests, friction-free, under one command: statics by Newton's method."""

import numpy as np
from numpy.typing import NDArray

from tests.planted.bench import FORCE_LIMIT, GAIN, GRAVITY, SPOOL_RADIUS, Bench, Causes

Array = NDArray[np.float64]


def weight_torque(bench: Bench, q: Array) -> Array:
    """Torque of gravity on the joints [N m], positive flexes; a slider is level."""
    if bench.kind == "slider":
        return np.zeros(2)
    second = bench.mass[1] * bench.length[1] / 2.0
    first = bench.mass[0] * bench.length[0] / 2.0 + bench.mass[1] * bench.length[0]
    tip = GRAVITY * second * np.cos(q[0] + q[1])
    return np.array([GRAVITY * first * np.cos(q[0]) + tip, tip])


def tendon_force(bench: Bench, causes: Causes, command: float, q: Array) -> float:
    """Tension [N] with the motor at rest and no friction."""
    angle = float(np.dot(bench.moment_arm, q)) / SPOOL_RADIUS + causes.offset
    ripple = causes.cogging * np.sin(causes.cogging_rate * angle + causes.cogging_phase)
    motor = causes.gain_scale * GAIN * (command - angle) + ripple
    return float(np.clip(motor, 0.0, FORCE_LIMIT))


def imbalance(bench: Bench, causes: Causes, command: float, q: Array) -> Array:
    """What is left of the torques on each coordinate [N m], slider [N]."""
    spring = causes.stiffness_scale * np.array(bench.stiffness) * q
    over = np.maximum(q - np.array(bench.upper), 0.0) + np.minimum(q, 0.0)
    pull = tendon_force(bench, causes, command, q) * np.array(bench.moment_arm)
    return pull + weight_torque(bench, q) - spring - np.array(bench.stop_stiffness) * over


def equilibrium(bench: Bench, causes: Causes, command: float) -> Array:
    """Coordinates at rest [rad], slider [m], shape (2,)."""
    joints = 2 if bench.kind == "finger" else 1
    q = np.zeros(2)
    left = imbalance(bench, causes, command, q)
    for _ in range(200):
        jacobian = _jacobian(bench, causes, command, q)[:joints, :joints]
        direction = np.zeros(2)
        direction[:joints] = -np.linalg.solve(jacobian, left[:joints])
        share = 1.0
        while share > 1e-9:
            tried = imbalance(bench, causes, command, q + share * direction)
            if np.linalg.norm(tried) < np.linalg.norm(left):
                break
            share /= 2.0
        else:
            break
        q, left = q + share * direction, tried
    if np.linalg.norm(left) > 1e-9:
        raise ArithmeticError(f"no rest under {command:.4f} rad: {left} are left at {q}.")
    return q


def _jacobian(bench: Bench, causes: Causes, command: float, q: Array) -> Array:
    """Central differences of the imbalance."""
    small = 1e-9
    columns = [
        imbalance(bench, causes, command, q + e) - imbalance(bench, causes, command, q - e)
        for e in small * np.eye(2)
    ]
    return np.stack(columns, axis=1) / (2.0 * small)
