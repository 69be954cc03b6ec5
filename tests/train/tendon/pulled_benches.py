"""Recordings of one made-up servo on benches whose lines give, with what each bench really is."""

from dataclasses import dataclass, replace

import numpy as np

from tendon_newton.data.excitations import excite
from tendon_newton.data.recording import Array, Recording

GAIN = 5.0  # [N/rad]
FRICTION = 2.0  # [N] that the servo holds
LAG = 0.06  # [s]
RADIUS = 0.0125  # [m]
LENGTHS = (0.030, 0.025)  # [m] of the finger's phalanges
SPRINGS = np.array([0.16, 0.11])  # [N m/rad], stiff enough to stay within the range


@dataclass(frozen=True, kw_only=True)
class Line:
    """A tendon from its spool to what it pulls."""

    stiffness: float  # [N/m]
    slack: float  # [m]
    friction: float  # [1] share by which the spool feels more
    arms: tuple[float, ...] = ()  # [m] none on a slider


TRUE = {
    "spring_weak": Line(stiffness=196.0, slack=1e-4, friction=0.05),
    "spring_strong": Line(stiffness=690.0, slack=3e-4, friction=0.05),
    "finger": Line(stiffness=7000.0, slack=4e-4, friction=0.05, arms=(0.0081, 0.0054)),
}


def pulled_log(
    bench: str, *, excitation: str = "random_steps", duration: float = 20.0, seed: int = 0
) -> Recording:
    """Record the servo on a bench; ``force`` is what its line felt.

    The servo approaches the balance with its load, lags, and holds within a band by friction.
    """
    line = TRUE[bench]
    arms = np.array(line.arms)
    # rad of joint and m of line that a newton moves
    give = arms / SPRINGS if arms.size else np.empty(0)
    stiffness = 1.0 / (1.0 / line.stiffness + float(arms @ give))
    time, command = excite(excitation, duration, np.random.default_rng(seed), 80.0)
    angle, direction = np.zeros_like(command), 0.0
    felt = np.zeros_like(command)
    position, load = line.slack / RADIUS, RADIUS * stiffness
    for row, asked in enumerate(command):
        rest = (GAIN * asked + stiffness * line.slack) / (GAIN + load)
        band = FRICTION / (GAIN + load)
        goal = max(line.slack / RADIUS, float(np.clip(position, rest - band, rest + band)))
        moved = (goal - position) * (1.0 - np.exp(-1.0 / (80.0 * LAG)))
        if row:
            direction = float(np.clip(direction + moved / 0.005, -1.0, 1.0))
        position += moved
        pull = max(0.0, stiffness * (RADIUS * position - line.slack))
        angle[row] = position
        felt[row] = pull * (1.0 + line.friction * direction)
    pull = np.maximum(0.0, stiffness * (RADIUS * angle - line.slack))
    return Recording(
        name=f"{bench}_{excitation}_{seed}.csv",
        bench=bench,
        time=time,
        command=command[:, None],
        motor_position=angle[:, None],
        motor_velocity=np.gradient(angle, time)[:, None],
        force=felt[:, None],
        tip=tip_of(pull[:, None] * give) if arms.size else None,
        start="first_row",
    )


def tip_of(joints: Array) -> Array:
    """Return where a finger's tip is, x and z [m], shape (T, 2)."""
    first, both = joints[:, 0], joints.sum(axis=1)
    return np.column_stack(
        [
            LENGTHS[0] * np.cos(first) + LENGTHS[1] * np.cos(both),
            -LENGTHS[0] * np.sin(first) - LENGTHS[1] * np.sin(both),
        ]
    )


def with_force(recording: Recording, force: Array | None) -> Recording:
    """Return a recording with another force [N], shape (T, 1), or none."""
    return replace(recording, force=force)
