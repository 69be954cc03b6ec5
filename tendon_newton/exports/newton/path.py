"""The way of a tendon as a polynomial of the joints, which a drive can evaluate anywhere."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from tendon_newton.data.recording import Array
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.mechanisms.geometry.parts import Tendon, excursion

DEGREE = 6  # Highest sum of powers of a routed tendon's terms
SAMPLES = 9  # Samples of each joint's range at which it is fitted
SWING = (-np.pi, np.pi)  # Range of a joint without end stops [rad]


@dataclass(frozen=True, kw_only=True)
class TendonPath:
    """Excursion as a sum of factors times powers of the joints."""

    factor: Array  # [m], shape (K,)
    powers: tuple[tuple[int, ...], ...]  # Power of each joint, shape (K, J)
    stray: float  # Most by which it strays from the tendon in its range [m]


def columns(q: Array, powers: Sequence[tuple[int, ...]]) -> Array:
    """Return products of powers of the joints, shape (N, K)."""
    return np.stack([np.prod(q ** np.array(row), axis=1) for row in powers], axis=1)


def path_of(mechanism: Mechanism, tendon: Tendon) -> TendonPath:
    """Return a tendon's way: exact with constant moment arms, else fitted over its range."""
    count = len(mechanism.joints)
    if tendon.route is None:
        powers = ((0,) * count, *(tuple(map(int, row)) for row in np.eye(count)))
        factor = np.array([tendon.excursion_offset, *tendon.moment_arm])
        return TendonPath(factor=factor, powers=powers, stray=0.0)
    used = [j for j in range(count) if np.any(tendon.moment_arm[j] != 0.0)]
    ends = [
        joint.limits if np.isfinite(joint.limits).all() else SWING for joint in mechanism.joints
    ]
    grid = [np.linspace(*ends[j], SAMPLES) if j in used else [0.0] for j in range(count)]
    q = np.array(list(product(*grid)))
    length = np.array([excursion(tendon, row) for row in q])
    choices = [range(DEGREE + 1) if j in used else (0,) for j in range(count)]
    powers = tuple(row for row in product(*choices) if sum(row) <= DEGREE)
    solved, *_ = np.linalg.lstsq(columns(q, powers), length, rcond=None)
    factor = np.asarray(solved, dtype=np.float64)
    stray = float(np.abs(columns(q, powers) @ factor - length).max())
    return TendonPath(factor=factor, powers=powers, stray=stray)
