r"""The numbers of one servo on several days, from commands and angles alone.

The law is that of a loop that shakes (`servo_loop`), closed on its own angle, with a load behind
the play:

.. math:: \dot v = g\,(u(t - d) - y - (\rho y - c)) - b v - \text{friction}

The load :math:`\rho y - c` pulls the joint through its play, and the motor where they touch. All
days are simulated side by side, each from its first angle, and walk to their least squares.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tendon_newton.data.oscillations.loop_fit import STEP, walked
from tendon_newton.data.oscillations.servo_loop import NAMES, RANGES, Servos
from tendon_newton.data.oscillations.shaking import Evenly
from tendon_newton.data.recording import Array, Mask

FITTED = ("delay", "pull", "damping", "sticking", "play", "load", "balance")
"""What is fitted: logarithms, but for the last, which is in radians."""
NUMBERS = ("delay", "lag", "friction", "play", "load")
"""What a day tells: d [s], b / g [s], friction over g [rad], play [rad], load [1]."""
LOW = np.array([*np.log([2e-3, 10.0, 3.0, 1e-3, 1e-3, 1e-3]), -0.6])
HIGH = np.array([*np.log([0.3, 2e4, 200.0, 0.3, 0.3, 4.0]), 0.6])
DRAWN = np.array([*np.log([5e-3, 40.0, 6.0, 4e-3, 3e-3, 0.02]), -0.05])
DRAWN_TO = np.array([*np.log([0.12, 2e3, 100.0, 0.06, 0.05, 0.8]), 0.05])
"""Bounds of a fit, and of its starts."""
DRAWS, STARTS, SEED = 120, 3, 5
FIRST = 6.0  # Of the first day's log, by which starts are chosen [s]
SLIDING = 0.8  # Friction in motion against that at rest [1]
BEHIND = 0.3  # Share of the inertia that is behind the play [1]
FADING = 5.0  # Of the joint's speed within the play [1/s]
SUBSTEP = 0.0125  # [s] at most
BLOCK = 1.0  # Time over which what a fit leaves may be alike [s]
PRIOR = 1.5  # Standard deviation of a number before anything is seen [1, of its logarithm]
TOUCHES = 0.499  # Of the play, from which two sides touch [1]


@dataclass(frozen=True, kw_only=True)
class DayFit:
    """What a day tells of a servo."""

    logs: Array  # Logarithms of the numbers, in the order of ``NUMBERS``, shape (5,)
    covariance: Array  # Of these, shape (5, 5)
    told: float  # Share of the angle's variance that the servo tells [1]

    def number(self, name: str) -> float:
        """Return a number by its name."""
        return float(np.exp(self.logs[NUMBERS.index(name)]))

    def spread(self, name: str) -> float:
        """Return the standard deviation of its logarithm [1]."""
        place = NUMBERS.index(name)
        return float(np.sqrt(self.covariance[place, place]))


class Stretches:
    """Stretches of all days beside each other, on one grid, shape (T, S)."""

    def __init__(self, days: Sequence[Sequence[Evenly]]) -> None:
        self.day = np.array([k for k, day in enumerate(days) for _ in day])
        self.count = len(days)
        every = [one for day in days for one in day]
        self.row = float(np.median([one.step for one in every]))
        self.parts = max(1, int(np.ceil(self.row / SUBSTEP - 1e-9)))
        rows = [round((len(one.angle) - 1) * one.step / self.row) + 1 for one in every]
        shape = (max(rows), len(every))
        self.command, self.angle = np.zeros(shape), np.zeros(shape)
        self.seen: Mask = np.zeros(shape, dtype=np.bool_)
        for k, (one, count) in enumerate(zip(every, rows, strict=True)):
            at = self.row * np.arange(shape[0])
            own = one.step * np.arange(len(one.angle))
            held = np.searchsorted(own, at + 1e-3 * self.row, side="right") - 1
            self.command[:, k], self.angle[:, k] = one.command[held], np.interp(at, own, one.angle)
            self.seen[:count, k] = True
        settled = np.arange(shape[0]) * self.row > BLOCK
        self.seen &= settled[:, None]

    def residuals(self, logs: Array) -> Array:
        """Return simulated less measured angles [rad], shape (S_max * T, N); 0 where not seen.

        Args:
            logs: What is fitted, shape (N, 7): equally many in a row for each day.
        """
        each = len(logs) // self.count
        which = [np.flatnonzero(self.day == k) for k in range(self.count)]
        owner = np.concatenate([np.repeat(own, each) for own in which])
        numbers = np.concatenate(
            [np.tile(logs[k * each : (k + 1) * each], (len(own), 1)) for k, own in enumerate(which)]
        )
        left = followed(numbers, self.command[:, owner], self.row, self.parts, self.angle[0, owner])
        left = np.where(self.seen[:, owner], left - self.angle[:, owner], 0.0)
        most, first, length = max(map(len, which)), 0, len(left)
        pooled = np.zeros((most, length, len(logs)))
        for k, own in enumerate(which):
            part = left[:, first : first + each * len(own)].reshape(length, len(own), each)
            pooled[: len(own), :, k * each : (k + 1) * each] = part.transpose(1, 0, 2)
            first += each * len(own)
        return pooled.reshape(most * length, len(logs))


def followed(logs: Array, command: Array, row: float, parts: int, first: Array) -> Array:
    """Return the angles of servos that follow commands [rad], shape (T, N)."""
    delay, pull, damping, sticking, width, load = np.exp(logs[:, :6]).T
    balance, step = logs[:, 6], row / parts
    numbers = np.tile([RANGES[name][0] for name in NAMES], (len(logs), 1))
    of_servo = {"delay": delay, "pull": pull, "damping": damping, "sticking": sticking}
    of_servo |= {"play": width, "sliding": SLIDING, "fading": FADING, "limit": RANGES["limit"][1]}
    for name, values in of_servo.items():
        numbers[:, NAMES.index(name)] = values
    servos = Servos(numbers, step, outer=False)
    servos.place[:] = servos.angle[:] = first
    angles, columns = np.empty_like(command), np.arange(len(logs))
    late, near, pushed = delay / step, TOUCHES * width, step * pull / BEHIND
    last = len(command) - 1
    for k in range(len(command)):
        angles[k] = servos.angle
        for part in range(parts):
            at = np.maximum(k * parts + part - late, 0.0)
            low = at.astype(np.intp)
            old, new = (
                command[low // parts, columns],
                command[np.minimum((low + 1) // parts, last), columns],
            )
            wanted = old + (at - low) * (new - old)
            weight = load * servos.angle - balance
            touches = np.abs(servos.place - servos.angle) >= near
            servos.rate = servos.rate - pushed * weight
            servos.advance(wanted - servos.angle - np.where(touches, weight, 0.0))
    return angles


def fit_days(days: Sequence[Sequence[Evenly]]) -> list[DayFit]:
    """Fit a servo to the stretches of each day; the first day's is the start of all."""
    rows = slice(round(FIRST / days[0][0].step))
    begin = replace(days[0][0], command=days[0][0].command[rows], angle=days[0][0].angle[rows])
    first = Stretches([[begin]])
    rng = np.random.default_rng(SEED)
    drawn = rng.uniform(DRAWN, DRAWN_TO, size=(DRAWS, len(FITTED)))
    squares = np.sum(first.residuals(drawn) ** 2, axis=0)
    starts = drawn[np.argsort(squares)[:STARTS]]
    ends, squares = walk(first, starts)
    every = Stretches(days)
    best, _ = walk(every, np.tile(ends[np.argmin(squares)], (len(days), 1)))
    return told_of(every, best)


def walk(stretches: Stretches, starts: Array) -> tuple[Array, Array]:
    """Walk from starts to least squares."""
    free = np.zeros(starts.shape, dtype=np.bool_)
    return walked(stretches.residuals, starts, free, (LOW, HIGH))


def told_of(stretches: Stretches, best: Array) -> list[DayFit]:
    """Return the numbers of fits with the covariance of their logarithms."""
    count, size = best.shape
    left = stretches.residuals(best)
    signs = np.where(best + STEP > HIGH, -1.0, 1.0)
    moved = best[:, None, :] + STEP * np.concatenate(
        [signs[:, :, None] * np.eye(size), -signs[:, :, None] * np.eye(size)], axis=1
    )
    near = stretches.residuals(moved.reshape(-1, size)).reshape(len(left), count, 2, size)
    slopes = (near[:, :, 0] - near[:, :, 1]) * signs / (2.0 * STEP)
    length = len(stretches.command)
    fits: list[DayFit] = []
    for k in range(count):
        own = np.flatnonzero(stretches.day == k)
        angle = np.concatenate([stretches.angle[stretches.seen[:, s], s] for s in own])
        seen = max(1, len(angle))
        variance = max(float(left[:, k] @ left[:, k]) / seen, 1e-12)
        spread = spread_of(slopes[:, k], left[:, k], variance, round(BLOCK / stretches.row), length)
        turned = turn(size)
        fits.append(
            DayFit(
                logs=turned @ best[k] + np.log([1.0, 1.0, SLIDING, 1.0, 1.0]),
                covariance=turned @ spread @ turned.T,
                told=1.0 - variance / max(float(angle.var()), 1e-12),
            )
        )
    return fits


def turn(size: int) -> Array:
    """Return what makes ``NUMBERS`` of ``FITTED``, shape (5, 7)."""
    turned = np.zeros((len(NUMBERS), size))
    for row, places in enumerate(((0,), (2,), (3,), (4,), (5,))):
        turned[row, list(places)] = 1.0
    turned[1, 1] = -1.0
    return turned


def spread_of(slopes: Array, left: Array, variance: float, block: int, length: int) -> Array:
    """Return a covariance that holds where what is left is alike within blocks of rows."""
    size = slopes.shape[1]
    pulls = slopes * left[:, None]
    starts = [first + k for first in range(0, len(left), length) for k in range(0, length, block)]
    blocks = np.add.reduceat(pulls, starts, axis=0)
    known = np.linalg.inv(slopes.T @ slopes / variance + np.eye(size) / PRIOR**2)
    return known @ (blocks.T @ blocks / variance**2 + np.eye(size) / PRIOR**2) @ known
