r"""How an arm stands: signs and zeros of its servos, and the tilt of its base, from where it hangs.

Beside its command a servo hangs by its load over its gain, and beside that by what holds it:

.. math:: \theta_j - \theta_{d,j} = s_j\,\tau_j(q) - w_j d_j - l_j \dot\theta_j

The weight tau_j is that of the posture, s the compliance, about that of the other servos, d the
direction of the last motion of the command, w what dry friction and deadband hold, l the lag. A
shaft goes the way its load pulls, so that s is positive: else every sign could be turned.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from tendon_newton.actuators.ideal_position import IdealPosition
from tendon_newton.arms.arm import Arm, ArmMotion
from tendon_newton.data.recording import Array, Indices, Mask
from tendon_newton.errors import InvalidRecording
from tendon_newton.mechanisms.geometry.joints import ReadOnlyArrays
from tendon_newton.mechanisms.geometry.mechanism import Mechanism

# Least weight on a joint [N m] that tells how its servo counts: it hangs by an encoder's count
LOADED = 0.02
# Least way of such a servo [rad]: one that stands hangs by its friction, to either side
MOVED = 0.1
# Share of what the best signs leave that may be left with fewer servos turned round
CLEARLY_BETTER = 1.1
MOST_LOADED = 10  # Joints whose signs are tried together: 1024 arms
THINNED = 0.5  # Time between the rows that are looked at [s]
SLOW = 0.5  # Speed of a servo [rad/s] up to which its lag is linear in it
# Way back [rad] from which on a command goes the other way: more than two counts of an encoder
TURNED = 0.004
SPREAD = 0.015  # Hanging [rad] from which on what is left of a row counts less: contacts, slips
# Rows of a motion that count for a servo: its strokes share what the equation lacks. Chosen: a
# motion of some seconds has about so many strokes.
INDEPENDENT = 10.0
# Standard deviation of zeros and tilts before anything is seen [rad]: homing by hand, a table
ZERO_SPREAD, TILT_SPREAD = 0.05, 0.03
USUAL = IdealPosition.parameters[0].nominal  # Compliance from which a fit starts [rad/(N m)]
# Share by which the compliance of one servo may be expected to differ from the others': an SO-101's
# differ by up to 0.15 from their mean (docs/lab/so101.md)
UNLIKE = 0.2


@dataclass(frozen=True, kw_only=True)
class Placement(ReadOnlyArrays):
    """An arm, and how surely it is known."""

    arm: Arm
    compliance: float  # What the servos' are about [rad/(N m)]
    loaded: Mask  # Whether a servo carries weight enough to be looked at, shape (J,)
    # Whether weight tells which way a servo counts, shape (J,); else it is as the file counts
    sign_told: Mask
    zero_sd: Array  # Standard deviation of each zero [rad], shape (J,)
    # Tilt of the base about its x and y axes against the asset's gravity [rad], shape (2,)
    tilt: Array
    tilt_sd: Array  # Standard deviation of the tilt [rad], shape (2,)


@dataclass(frozen=True, kw_only=True)
class Hanging:
    """Rows of motions in which servos hang beside their commands."""

    angles: Array  # [rad], shape (N, J)
    beside: Array  # Angle less command [rad], shape (N, J)
    direction: Array  # Direction of the command's last motion, shape (N, J)
    rate: Array  # [rad/s], shape (N, J)
    weight: Array  # Weight of each row [1], shape (N, J)


def find_placement(mechanism: Mechanism, motions: Sequence[ArmMotion]) -> Placement:
    """Find signs, zeros and tilt from where an arm's servos hang.

    Joints are those of the motions, in their order.

    Raises:
        InvalidRecording: There are not as many servos as joints, or the arm hangs upwards.
    """
    joints, servos = mechanism.joint_names, len(motions[0].recordings)
    if len(joints) != servos:
        raise InvalidRecording(
            f"{mechanism.name!r} has {len(joints)} joints ({', '.join(joints)}); "
            f"there are recordings of {servos} servos"
        )
    hanging = hanging_rows(motions)
    plain = Arm(
        mechanism=mechanism, sign=np.ones(servos), zero=np.zeros(servos), gravity=mechanism.gravity
    )
    heavy = np.abs(plain.weight(hanging.angles)).max(axis=0) > LOADED
    loaded = np.flatnonzero(heavy & (np.ptp(hanging.angles, axis=0) > MOVED))[:MOST_LOADED]
    costs: dict[tuple[float, ...], float] = {}
    for signs in product((1.0, -1.0), repeat=len(loaded)):
        sign = np.ones(servos)
        sign[loaded] = signs
        compliance, cost = plain_cost(replace(plain, sign=sign), hanging, loaded)
        if compliance > 0.0:
            costs[tuple(sign)] = cost
    if not costs:
        raise InvalidRecording(
            f"{motions[0].recordings[0].name}: the servos of an arm hang where its weight pulls "
            f"them; those of {mechanism.name!r} hang the other way whatever their signs"
        )
    most = CLEARLY_BETTER * min(costs.values())
    best = min((s for s in costs if costs[s] <= most), key=lambda s: s.count(-1.0))
    told = np.zeros(servos, dtype=np.bool_)
    for j in loaded:
        other = tuple(-s if k == j else s for k, s in enumerate(best))
        told[j] = costs.get(other, np.inf) > most
    return refined(replace(plain, sign=np.array(best)), hanging, loaded, told)


def hanging_rows(motions: Sequence[ArmMotion]) -> Hanging:
    """Take rows from motions, in which each servo counts by how slowly it goes."""
    parts = []
    for motion in motions:
        step = max(round(THINNED / float(np.median(np.diff(motion.time)))), 1)
        rows = np.arange(0, len(motion.time), step)
        rate = np.gradient(motion.angles, motion.time, axis=0)[rows]
        slow = np.abs(rate) < SLOW
        share = np.minimum(INDEPENDENT / np.maximum(slow.sum(axis=0), 1.0), 1.0)
        going = np.column_stack([last_direction(c) for c in motion.commands.T])[rows]
        beside = (motion.angles - motion.commands)[rows]
        parts.append((motion.angles[rows], beside, going, rate, np.sqrt(slow * share)))
    names = ("angles", "beside", "direction", "rate", "weight")
    return Hanging(**dict(zip(names, map(np.concatenate, zip(*parts, strict=True)), strict=True)))


def last_direction(command: Array) -> Array:
    """Return in which direction a command moved last, shape (T,); 0 before it moves."""
    out, far, way = np.zeros(len(command)), float(command[0]), 0.0
    for k, at in enumerate(command.tolist()):
        if abs(at - far) > TURNED and (at - far) * way <= 0.0:
            way = 1.0 if at > far else -1.0
        if way == 0.0:
            continue
        far = max(far, at) if way > 0.0 else min(far, at)
        out[k] = way
    return out


def plain_cost(arm: Arm, hanging: Hanging, loaded: Indices) -> tuple[float, float]:
    """Return the compliance [rad/(N m)] that fits best, and what is left unexplained [1]."""
    start = np.concatenate([[USUAL], np.zeros(3 * len(loaded))])
    weights = arm.weight(hanging.angles)
    found = least_squares(lambda x: left(weights, hanging, loaded, x), start)
    return float(found.x[0]), float(found.cost)


def left(weights: Array, hanging: Hanging, loaded: Indices, numbers: Array) -> Array:
    """Return what a servo's numbers leave of the hanging [1]; far beyond `SPREAD` rows count less.

    Args:
        weights: Torque of gravity at each servo [N m], shape (N, J).
        numbers: The common compliance, and by servo the share by which its own differs, what
            friction holds and its lag; others may follow.
    """
    own = numbers[1 : 1 + 3 * len(loaded)].reshape(-1, 3)
    out = [own[:, 0] / UNLIKE]
    for j, (unlike, friction, lag) in zip(loaded, own, strict=True):
        told = numbers[0] * (1.0 + unlike) * weights[:, j]
        told = told - friction * hanging.direction[:, j] - lag * hanging.rate[:, j]
        far = (hanging.beside[:, j] - told) / SPREAD
        robust = np.sqrt(2.0) * far / np.sqrt(1.0 + np.sqrt(1.0 + far**2))  # its square: soft L1
        out.append(hanging.weight[:, j] * robust)
    return np.concatenate(out)


def tipped(gravity: Array, tilt: Array) -> Array:
    """Return gravity [m/s2] in the axes of a base that is tilted about x, then y [rad]."""
    return Rotation.from_euler("xy", tilt).as_matrix().T @ gravity


def refined(arm: Arm, hanging: Hanging, loaded: Indices, told: Mask) -> Placement:
    """Fit zeros and tilt as well, held by how far they may be expected to be off."""
    servos, own = len(arm.sign), 1 + 3 * len(loaded)
    spreads = np.concatenate([np.full(len(loaded), ZERO_SPREAD), np.full(2, TILT_SPREAD)])

    def stands(x: Array) -> Arm:
        zero = np.zeros(servos)
        zero[loaded] = x[own:-2]
        return replace(arm, zero=zero, gravity=tipped(arm.mechanism.gravity, x[-2:]))

    def misses(x: Array) -> Array:
        weights = stands(x).weight(hanging.angles)
        return np.append(left(weights, hanging, loaded, x), x[own:] / spreads)

    start = np.concatenate([[USUAL], np.zeros(own - 1 + len(spreads))])
    found = least_squares(misses, start)
    spread = np.sqrt(np.maximum(np.diag(np.linalg.pinv(found.jac.T @ found.jac)), 0.0))
    zero_sd = np.full(servos, ZERO_SPREAD)
    zero_sd[loaded] = spread[own:-2]
    return Placement(
        arm=stands(found.x), compliance=float(found.x[0]), sign_told=told, zero_sd=zero_sd,
        loaded=np.isin(np.arange(servos), loaded), tilt=found.x[-2:], tilt_sd=spread[-2:],
    )  # fmt: skip
