"""Where the plant rests, friction-free, under one command: statics by Newton's method."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from tests.planted.bench import FORCE_LIMIT, GAIN, GRAVITY, SPOOL_RADIUS, Bench
from tests.planted.causes import Causes

Array = NDArray[np.float64]

KNEE = 0.05  # width of a planted saturation's knee, against its limit
ROUNDS = 60  # of the fixed point of a tendon that stretches; it gains a digit every other one


def weight_torque(bench: Bench, causes: Causes, q: Array) -> Array:
    """Torque of gravity on the joints [N m], positive flexes; along a slider's rail [N]."""
    mass = causes.mass_scale * np.array(bench.mass)
    if bench.kind == "slider":
        return np.array([mass[0] * GRAVITY * np.sin(causes.tilt), 0.0])
    second = mass[1] * bench.length[1] / 2.0
    first = mass[0] * bench.length[0] / 2.0 + mass[1] * bench.length[0]
    tip = GRAVITY * second * np.cos(q[0] + q[1] + causes.tilt)
    return np.array([GRAVITY * first * np.cos(q[0] + causes.tilt) + tip, tip])


def tendon_force(
    bench: Bench, causes: Causes, command: float, q: Array, gain: float = 1.0
) -> float:
    """Tension [N] with the motor at rest and no friction."""
    give = causes.compliance + causes.mount_compliance
    wound = float(np.dot(bench.moment_arm, q)) + causes.slack
    pull = 0.0
    for _ in range(ROUNDS if give else 1):
        angle = (wound + give * pull) / (causes.radius_scale * SPOOL_RADIUS) + causes.offset
        pull = max(0.0, _motor_force(causes, command, angle, gain))
    return pull


def _motor_force(causes: Causes, command: float, angle: float, gain: float) -> float:
    error = command - angle
    error = float(np.sign(error)) * max(0.0, abs(error) - causes.deadband)
    force = gain * causes.gain_scale * GAIN * error
    force += causes.cogging * np.sin(causes.cogging_rate * angle + causes.cogging_phase)
    away = (angle - causes.dead_spot_at) / causes.dead_spot_width
    force *= 1.0 - causes.dead_spot * np.exp(-(away**2))
    if causes.saturation:
        knee = KNEE * causes.saturation
        kept = causes.saturation - knee * np.logaddexp(0.0, (causes.saturation - abs(force)) / knee)
        return float(np.sign(force) * max(0.0, kept))
    return float(np.clip(force, -FORCE_LIMIT, FORCE_LIMIT))


def imbalance(bench: Bench, causes: Causes, pull: float, q: Array) -> Array:
    """What is left of the torques on each coordinate under a tension [N m], slider [N]."""
    upper = np.array(bench.upper)
    reach = np.divide(q, upper, out=np.zeros(2), where=upper > 0.0)
    spring = causes.stiffness_scale * np.array(bench.stiffness) * q
    spring *= 1.0 + causes.stiffening * reach**2
    over = np.maximum(q - upper, 0.0) + np.minimum(q, 0.0)
    arm = np.array(bench.moment_arm)
    blocked = max(0.0, float(arm @ q) - causes.obstruction_at * SPOOL_RADIUS)
    passed = pull - causes.obstruction * blocked
    weight = weight_torque(bench, causes, q)
    return passed * arm + weight - spring - np.array(bench.stop_stiffness) * over


def equilibrium(bench: Bench, causes: Causes, command: float, gain: float = 1.0) -> Array:
    """Coordinates at rest [rad], slider [m], shape (2,)."""

    def left(q: Array) -> Array:
        return imbalance(bench, causes, tendon_force(bench, causes, command, q, gain), q)

    joints = 2 if bench.kind == "finger" else 1
    q = _descend(left, joints)
    return q if np.linalg.norm(left(q)) < 1e-9 else _bisected(bench, causes, command, gain)


def _bisected(bench: Bench, causes: Causes, command: float, gain: float) -> Array:
    """One of several rests, which a rippling motor force makes: by halving the tension's range."""
    joints = 2 if bench.kind == "finger" else 1
    low, high = 0.0, FORCE_LIMIT
    for _ in range(60):
        middle = 0.5 * (low + high)
        q = _descend(lambda q, pull=middle: imbalance(bench, causes, pull, q), joints)
        wanting = tendon_force(bench, causes, command, q, gain) > middle
        low, high = (middle, high) if wanting else (low, middle)
    return _descend(lambda q: imbalance(bench, causes, low, q), joints)


def _descend(left: Callable[[Array], Array], joints: int) -> Array:
    """Newton's method from the open mechanism, with steps that never make it worse."""
    q = np.zeros(2)
    now = left(q)
    for _ in range(200):
        direction = np.zeros(2)
        direction[:joints] = -np.linalg.solve(_jacobian(left, q)[:joints, :joints], now[:joints])
        share = 1.0
        while share > 1e-9:
            tried = left(q + share * direction)
            if np.linalg.norm(tried) < np.linalg.norm(now):
                break
            share /= 2.0
        else:
            break
        q, now = q + share * direction, tried
    return q


def _jacobian(left: Callable[[Array], Array], q: Array) -> Array:
    """Central differences of what is left."""
    small = 1e-9
    columns = [left(q + e) - left(q - e) for e in small * np.eye(2)]
    return np.stack(columns, axis=1) / (2.0 * small)
