"""Whether an engine computes the motion at all, before it is timed.

Every engine makes the same fingers swing, from the same rest, with dry friction and end stops, and
with jumps of the command of up to 3 rad. The reference is our solver in float64 with steps of
0.05 ms; halving them moves it by less than 1e-4 rad RMS. An engine is *sound* at a step if all its
joints stay finite and within reach of their stops in every row, and if they are near the reference.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Protocol, TypeVar

import numpy as np
import warp as wp

from tendon_newton.mechanisms.loading import load_mechanism

CONTROL_STEP = 0.05  # One control step of a policy [s]
ROWS = 60  # Control steps of a check: one whole swing
ACCURACY = 0.02
"""Largest RMS distance from the reference, over worlds, rows and joints [rad]: a degree, of joints
that move through 80 and 100."""
REACH = 0.3  # How far beyond an end stop a joint may be [rad]; the reference stays within 0.01
LADDER = (4, 6, 8, 10, 12, 16, 20, 26, 32, 40, 50, 64, 80, 100, 126, 160, 200, 256, 320, 400)
"""Substeps of a control step that are tried, longest steps first; even, so that an engine with two
states ends where it began."""


class UnsoundEngine(RuntimeError):
    """An engine that leaves the motion which it should compute."""


class Engine(Protocol):
    """Many fingers under one way to compute their motion."""

    def begin(self) -> None:
        """Put all fingers at rest, and their swings at the start."""
        ...

    def run(self) -> None:
        """Do one control step."""
        ...

    def joints(self) -> np.ndarray:
        """Return the joint angles now [rad], shape (W, J)."""
        ...


E = TypeVar("E", bound=Engine)
Limits = Sequence[tuple[float, float]]


@cache
def finger_limits() -> Limits:
    """Return the end stops of the finger's joints [rad]."""
    return load_mechanism("finger").joint_limits


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """What a check found."""

    error: float  # RMS distance from the reference [rad], of the worlds that have not escaped
    escaped: int  # Worlds that were not finite or out of reach in some row

    @property
    def sound(self) -> bool:
        """Whether the engine may be timed."""
        return self.escaped == 0 and self.error < ACCURACY


def path(engine: Engine) -> np.ndarray:
    """Return the joints after each control step of a swing from rest [rad], shape (T, W, J)."""
    engine.begin()
    rows = []
    for _ in range(ROWS):
        wp.synchronize()  # torch's stream and Warp's are two
        engine.run()
        wp.synchronize()
        rows.append(engine.joints().copy())
    return np.array(rows)


def escaped_worlds(joints: np.ndarray, limits: Limits) -> np.ndarray:
    """Return which worlds have a joint that is not finite or out of reach, shape (W,).

    Args:
        joints: Angles [rad], shape (..., W, J).
        limits: End stops of each joint [rad].
    """
    lower, upper = np.array(limits).T
    inside = (joints > lower - REACH) & (joints < upper + REACH)  # false for what is not a number
    return ~inside.all(axis=-1).reshape(-1, joints.shape[-2]).all(axis=0)


def refuse_escaped(name: str, joints: np.ndarray, limits: Limits) -> None:
    """Refuse an engine some of whose worlds are not where they can be.

    Args:
        name: What the engine is called.
        joints: Angles [rad], shape (W, J).
        limits: End stops of each joint [rad].

    Raises:
        UnsoundEngine: Some worlds are not finite or out of reach.
    """
    if escaped := int(escaped_worlds(joints, limits).sum()):
        raise UnsoundEngine(
            f"{name} must keep joints within {REACH} rad of their stops; {escaped} of "
            f"{len(joints)} worlds are not"
        )


def judge(found: np.ndarray, reference: np.ndarray) -> Verdict:
    """Compare two paths [rad], shape (T, W, J)."""
    escaped = escaped_worlds(found, finger_limits())
    error = (found - reference)[:, ~escaped]
    rms = float(np.sqrt(np.mean(error**2))) if error.size else float("nan")
    return Verdict(error=rms, escaped=int(escaped.sum()))


def largest_sound(
    name: str, make: Callable[[float], E], reference: np.ndarray, *, fewest: int = 0
) -> tuple[E, int, Verdict]:
    """Return an engine at the largest step of the ladder at which it is sound.

    Args:
        name: What the engine is called.
        make: Builds it with steps of so many seconds.
        reference: Path of the reference [rad], shape (T, W, J).
        fewest: Substeps of a control step to begin with.

    Returns:
        The engine, its substeps of a control step, and what the check found.

    Raises:
        UnsoundEngine: It is sound at no step of the ladder.
    """
    found = []
    for substeps in (n for n in LADDER if n >= fewest):
        engine = make(CONTROL_STEP / substeps)
        verdict = judge(path(engine), reference)
        if verdict.sound:
            return engine, substeps, verdict
        found.append(
            f"{1e3 * CONTROL_STEP / substeps:.3g} ms: {verdict.error:.2g} rad, "
            f"{verdict.escaped} worlds escaped"
        )
        del engine
    raise UnsoundEngine(f"{name} must be within {ACCURACY} rad at some step; " + "; ".join(found))
