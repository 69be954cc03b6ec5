r"""Equilibrium of a mechanism under tendon tension, without friction and without motion.

At rest the spring, the end stops, gravity and the tendons balance in every joint:

.. math:: -k_j (q_j - q_{0j}) + s_j(q_j) + g_j(q) + \sum_d a_{dj}(q) T_d = 0

with :math:`s_j` the one-sided end stops and :math:`g_j` the torque of gravity.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from tendon_newton.data.recording import Array
from tendon_newton.errors import InvalidParameter
from tendon_newton.mechanisms.geometry.joint_frames import ancestors
from tendon_newton.mechanisms.geometry.joints import ReadOnlyArrays
from tendon_newton.mechanisms.geometry.kinematics import posture, tip_position
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.parts import arm_slope, excursion, moment_arms

RESIDUAL = 1.0e-10  # An equilibrium is found when no joint is off by more [N m]
ITERATIONS = 200
STEP_LIMIT = 0.5  # Longest Newton step [rad]: gravity and stops are not linear beyond


@dataclass(frozen=True, kw_only=True)
class ClosingPath(ReadOnlyArrays):
    """The equilibria that a mechanism passes through while tendons close it."""

    tension: Array  # Tension of each tendon that closes [N], shape (N,)
    joint_position: Array  # Joint positions [rad], shape (N, J)
    excursion: Array  # Excursion of that tendon, or of the first of several [m], shape (N,)
    tip: Array | None  # Tip in the base frame [m], shape (N, 3)


def gravity_torque(
    mechanism: Mechanism, joint_position: Array, gravity: Array | None = None
) -> Array:
    """Return the torque of gravity in each joint at positions (..., J) [rad], in [N m], (..., J).

    Gravity [m/s^2], shape (3,), is the mechanism's own by default.
    """
    g = mechanism.gravity if gravity is None else gravity
    if not np.any(g):
        return np.zeros(np.shape(joint_position))
    frames = posture(mechanism, joint_position)
    torque = np.zeros(np.shape(joint_position))
    turned = np.cross(np.eye(3), g)  # lever @ turned = lever x g
    for link, joint in enumerate(mechanism.joints):
        center = frames.place(link, joint.center_of_mass)
        for j in ancestors(mechanism.parents, link):
            pull = (
                g
                if mechanism.joints[j].kind == "prismatic"
                else (center - frames.anchor[j]) @ turned
            )
            torque[..., j] += joint.mass * np.sum(frames.axis[j] * pull, axis=-1)
    return torque


def passive_torque(
    mechanism: Mechanism, joint_position: Array, gravity: Array | None = None
) -> Array:
    """Return the torque of springs, end stops and gravity in each joint [N m], shape (J,)."""
    q = np.asarray(joint_position, dtype=np.float64)
    spring = _column(mechanism, "stiffness") * (q - _column(mechanism, "rest"))
    lower, upper = np.array(mechanism.joint_limits).T
    beyond = np.maximum(q - upper, 0.0) + np.minimum(q - lower, 0.0)
    stop = _column(mechanism, "stop_stiffness") * beyond
    return gravity_torque(mechanism, q, gravity) - spring - stop


def _column(mechanism: Mechanism, name: str) -> Array:
    """Return one number of every joint, shape (J,)."""
    return np.array([getattr(joint, name) for joint in mechanism.joints])


def equilibrium(
    mechanism: Mechanism,
    tension: Array,
    *,
    gravity: Array | None = None,
    start: Array | None = None,
) -> Array:
    """Return the joint positions at which a mechanism rests [rad], shape (J,).

    Tensions [N] have the shape (D,). Gravity [m/s^2], shape (3,), is the mechanism's own by
    default; the search starts at the springs' rest, or at positions (J,) [rad].
    """
    T = np.asarray(tension, dtype=np.float64)
    q = np.array([joint.rest for joint in mechanism.joints]) if start is None else np.array(start)

    def residual(at: Array) -> Array:
        torque = passive_torque(mechanism, at, gravity)
        for tendon, pull in zip(mechanism.tendons, T, strict=True):
            torque = torque + moment_arms(tendon, at) * pull
        return torque

    for _ in range(ITERATIONS):
        r = residual(q)
        if np.max(np.abs(r)) < RESIDUAL:
            return q
        q = _newton_step(residual, _stiffness(mechanism, q, T, gravity), q, r)
    raise InvalidParameter(
        f"{mechanism.name!r} has no equilibrium under a tension of {T.tolist()} N: "
        "nothing holds it there."
    )


def _stiffness(mechanism: Mechanism, q: Array, T: Array, gravity: Array | None) -> Array:
    """Return minus the derivative of the joint torques [N m/rad], shape (J, J).

    Springs and stops are written out, since a difference across the edge of a stop would mix its
    two sides; gravity is smooth.
    """

    def weight(at: Array) -> Array:
        return gravity_torque(mechanism, at, gravity)

    h = 1.0e-5  # [rad] central difference in float64
    slope = [(weight(q + h * e) - weight(q - h * e)) / (2.0 * h) for e in np.eye(q.size)]
    turning = [arm_slope(t, q) * pull for t, pull in zip(mechanism.tendons, T, strict=True)]
    lower, upper = np.array(mechanism.joint_limits).T
    inside = (q >= lower) & (q <= upper)
    stop = np.where(inside, 0.0, _column(mechanism, "stop_stiffness"))
    springs = np.diag(_column(mechanism, "stiffness") + stop)
    return springs - np.column_stack(slope) - np.sum(turning, axis=0)


def _newton_step(residual: Callable[[Array], Array], K: Array, q: Array, r: Array) -> Array:
    """Return where one Newton step leads; it is halved until the residual shrinks."""
    step = np.linalg.lstsq(K, r, rcond=None)[0]
    step *= min(1.0, STEP_LIMIT / max(float(np.max(np.abs(step))), STEP_LIMIT))
    for _ in range(30):
        if np.linalg.norm(residual(q + step)) < np.linalg.norm(r):
            break
        step = step / 2.0
    return q + step


def closing_tendons(mechanism: Mechanism) -> tuple[int, ...]:
    """Return the tendons that close, by their arms in the closed mechanism: all but the opening."""
    closed = closed_position(mechanism)
    arms = [moment_arms(tendon, closed) for tendon in mechanism.tendons]
    return tuple(d for d, arm in enumerate(arms) if np.all(arm >= 0.0) and np.any(arm > 0.0))


def closing_tension(
    mechanism: Mechanism, tendon: int | Sequence[int] = 0, gravity: Array | None = None
) -> float:
    """Return the tension that brings every joint on some tendons to its upper limit [N].

    For a direct drive, which has no range, it is the torque that holds a quarter turn. Several
    tendons have one tension; gravity is as for `gravity_torque`.
    """
    closed = closed_position(mechanism)
    arms = sum(moment_arms(mechanism.tendons[d], closed) for d in np.atleast_1d(tendon))
    needed = -passive_torque(mechanism, closed, gravity)
    return float(max((needed[j] / arms[j] for j in np.flatnonzero(arms > 0.0)), default=0.0))


def closed_position(mechanism: Mechanism) -> Array:
    """Return the joint positions of the closed mechanism [rad], shape (J,)."""
    upper = np.array([joint.limits[1] for joint in mechanism.joints])
    return np.where(np.isfinite(upper), upper, np.pi / 2.0)


def closing_path(
    mechanism: Mechanism,
    *,
    tendon: int | Sequence[int] = 0,
    count: int = 101,
    gravity: Array | None = None,
) -> ClosingPath:
    """Follow the equilibria from slack tendons until every joint that they act on is closed.

    One tendon closes it, or several under one tension; the others stay slack. There are so many
    equilibria; gravity is as for `gravity_torque`.
    """
    # Denser towards the end, where a pendulum's angle grows without bound.
    spacing = np.sin(np.linspace(0.0, np.pi / 2.0, count))
    tension = closing_tension(mechanism, tendon, gravity) * spacing
    closing = np.atleast_1d(tendon)
    pull = np.isin(np.arange(len(mechanism.tendons)), closing).astype(np.float64)
    positions: list[Array] = []
    for T in tension:
        start = positions[-1] if positions else None
        positions.append(equilibrium(mechanism, T * pull, gravity=gravity, start=start))
    joint_position = np.array(positions)
    tips = [tip_position(mechanism, q) for q in positions]
    return ClosingPath(
        tension=tension,
        joint_position=joint_position,
        excursion=excursion(mechanism.tendons[closing[0]], joint_position),
        tip=None if mechanism.tip is None else np.array(tips),
    )
