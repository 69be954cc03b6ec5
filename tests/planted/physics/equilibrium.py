"""Where the plant rests, friction-free, under one command: statics by Newton's method."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tests.planted.physics.bench import FORCE_LIMIT, GAIN, GRAVITY, SPOOL_RADIUS, Bench
from tests.planted.physics.causes import Causes
from tests.planted.physics.servo import DcServo

Array = NDArray[np.float64]

EDGE = 0.1  # width of a deadband's rounded edge, against the deadband
ROUNDS = 60  # of the fixed point of a tendon that stretches; it gains a digit every other one


def weight_torque(bench: Bench, causes: Causes, q: Array) -> Array:
    """Torque of gravity on the joints [N m], positive flexes; along a slider's rail [N]."""
    mass = causes.mass_scale * np.array(bench.mass)
    if bench.kind == "pendulum":
        return np.array([-mass[0] * GRAVITY * bench.length[0] * np.sin(q[0] + causes.tilt), 0.0])
    if bench.kind == "slider":
        return np.array([mass[0] * GRAVITY * np.sin(causes.tilt), 0.0])
    second = mass[1] * bench.length[1] / 2.0
    first = mass[0] * bench.length[0] / 2.0 + mass[1] * bench.length[0]
    tip = GRAVITY * second * np.cos(q[0] + q[1] + causes.tilt)
    return np.array([GRAVITY * first * np.cos(q[0] + causes.tilt) + tip, tip])


@dataclass(frozen=True, kw_only=True)
class Drive:
    """What pulls a bench at rest."""

    command: float  # [rad]
    gain: float = 1.0  # Against its mean [1]
    servo: DcServo | None = None  # None is the ideal source


def tendon_force(bench: Bench, causes: Causes, drive: Drive, q: Array) -> float:
    """Tension [N] with the motor at rest and no friction."""
    give = causes.compliance + causes.mount_compliance
    radius = causes.radius_scale * bench.spool_radius
    wound = float(np.dot(bench.moment_arm, q)) + causes.slack
    pull = 0.0
    for _ in range(ROUNDS if give else 1):
        angle = (wound + give * pull) / radius + causes.offset
        pull = _motor_force(causes, drive, radius, angle)
        pull = pull if bench.direct else max(0.0, pull)
    return pull


def _motor_force(causes: Causes, drive: Drive, radius: float, angle: float) -> float:
    error = _beyond(drive.command - angle, causes.backlash / 2.0)
    error = drive.gain * causes.gain_scale * _past_deadband(causes, error)
    if drive.servo is not None:
        error += float(np.sign(error)) * causes.starting_duty / drive.servo.duty_per_rad
        return drive.servo.force_at_rest(error, radius)
    force = GAIN * error + float(np.sign(error)) * causes.starting_duty * FORCE_LIMIT
    force += causes.cogging * np.sin(causes.cogging_rate * angle + causes.cogging_phase)
    away = (angle - causes.dead_spot_at) / causes.dead_spot_width
    force *= 1.0 - causes.dead_spot * np.exp(-(away**2))
    if causes.saturation:
        knee = causes.knee * causes.saturation
        kept = causes.saturation - knee * np.logaddexp(0.0, (causes.saturation - abs(force)) / knee)
        force = float(np.sign(force) * max(0.0, kept))
    else:
        force = float(np.clip(force, -FORCE_LIMIT, FORCE_LIMIT))
    return _faded(causes, force / (1.0 + causes.sag * abs(force)))


def _beyond(error: float, gap: float) -> float:
    """Return what an error [rad] exceeds a gap by, either way."""
    return float(np.sign(error)) * max(0.0, abs(error) - gap)


def _past_deadband(causes: Causes, error: float) -> float:
    """Return the error that the servo acts on [rad]."""
    if not causes.second_form or not causes.deadband:
        return _beyond(error, causes.deadband)
    width = EDGE * causes.deadband
    over = (abs(error) - causes.deadband) / width
    return float(np.sign(error) * width * np.logaddexp(0.0, over))


def _faded(causes: Causes, force: float) -> float:
    """Return the force that is left of a motor's when it has settled: F (1 + fade F^2) = F_m."""
    if causes.fade == 0.0:
        return force
    third = 1.0 / (3.0 * causes.fade)
    return float(2.0 * np.sqrt(third) * np.sinh(np.arcsinh(1.5 * force / np.sqrt(third)) / 3.0))


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


def equilibrium(bench: Bench, causes: Causes, drive: Drive) -> Array:
    """Coordinates at rest [rad], slider [m], shape (2,)."""

    def left(q: Array) -> Array:
        return imbalance(bench, causes, tendon_force(bench, causes, drive, q), q)

    joints = 2 if bench.kind == "finger" else 1
    q = _descend(left, joints)
    return q if np.linalg.norm(left(q)) < 1e-9 else _bisected(bench, causes, drive)


def _bisected(bench: Bench, causes: Causes, drive: Drive) -> Array:
    """One of several rests, which a rippling motor force makes: by halving the tension's range."""
    joints = 2 if bench.kind == "finger" else 1
    low, high = 0.0, FORCE_LIMIT
    for _ in range(60):
        middle = 0.5 * (low + high)
        q = _descend(lambda q, pull=middle: imbalance(bench, causes, pull, q), joints)
        wanting = tendon_force(bench, causes, drive, q) > middle
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
