"""The books of a slider on a spring: what its tendon carries, and where that force and work go."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.interpolate import make_interp_spline

from tendon_newton.data.recording import Array

DEGREE = 5
"""Of the splines between two jumps of the force."""
DAMPING = 5.0  # N s/m
MASS = 0.05  # kg
STIFFNESS = {"spring_weak": 200.0, "spring_strong": 800.0}  # N/m


@dataclass(frozen=True, kw_only=True)
class Books:
    """One run of a spring bench, row by row; the force of a row is that just after its instant."""

    bench: str
    time: Array
    """[s], shape (T,)."""
    slide: Array
    """[m], shape (T,)."""
    force: Array
    """Tension that the load cell reports [N], shape (T,)."""
    jumps: Array
    """Rows at which the force may jump, because a command or an answer changes."""
    speed: Array | None = None
    """Of the slide [m/s], shape (T,); by default its spline's."""
    unread: int = 0
    """Rows after a jump whose force was not read."""

    @property
    def stretches(self) -> Sequence[slice]:
        """Rows from one jump to the next, both included: position and speed have no jumps."""
        edges = np.unique(np.concatenate([[0], self.jumps, [len(self.time) - 1]]))
        return [slice(first, last + 1) for first, last in pairwise(edges) if last - first > DEGREE]

    def motion(self, rows: slice) -> tuple[Array, Array]:
        """Return speed [m/s] and acceleration [m/s2] between two jumps."""
        time = self.time[rows]
        if self.speed is not None:
            return self.speed[rows], make_interp_spline(time, self.speed[rows], k=DEGREE)(time, 1)
        spline = make_interp_spline(time, self.slide[rows], k=DEGREE)
        return spline(time, 1), spline(time, 2)

    def imbalance(self) -> Array:
        """Return F - (m x'' + c x' + k x) [N] of all rows but those at which a stretch ends."""
        left = []
        for rows in self.stretches:
            speed, acceleration = self.motion(rows)
            carried = MASS * acceleration + DAMPING * speed
            carried += STIFFNESS[self.bench] * self.slide[rows]
            left.append((self.force[rows] - carried)[self.unread : -1])
        return np.concatenate(left)

    def work(self) -> tuple[float, float]:
        """Return the tension's work [J], and what of it is stored or lost to damping [J]."""
        done = kept = 0.0
        for rows in self.stretches:
            time, slide = self.time[rows], self.slide[rows]
            # of the slide itself: in a first-order step the speed is ahead of it
            speed = make_interp_spline(time, slide, k=DEGREE)(time, 1)
            force = self.force[rows].copy()
            force[-1] = 3.0 * force[-2] - 3.0 * force[-3] + force[-4]  # before the jump, not after
            power = make_interp_spline(time, force * speed, k=DEGREE)
            lost = make_interp_spline(time, DAMPING * speed**2, k=DEGREE)
            done += float(power.integrate(time[0], time[-1]))
            kept += float(lost.integrate(time[0], time[-1]))
            kept += 0.5 * MASS * float(speed[-1] ** 2 - speed[0] ** 2)
            kept += 0.5 * STIFFNESS[self.bench] * float(slide[-1] ** 2 - slide[0] ** 2)
        return done, kept


def one_step(rate: float) -> Array:
    """Return 0.5 rad, and 2.5 rad from 0.25 s to 1.5 s, at so many rows a second [rad]."""
    return np.where(np.arange(round(1.5 * rate)) < round(0.25 * rate), 0.5, 2.5)


def random_steps(rate: float) -> Array:
    """Return 12 s of levels within 0.5 to 5 rad, each held 0.4 s [rad]."""
    levels = np.random.default_rng(20260101).uniform(0.5, 5.0, 30)
    return np.repeat(levels, round(0.4 * rate))


def jumps_of(command: Array, query_rows: int | None = None) -> Array:
    """Return the rows from which on another command holds, and those at which a network answers."""
    asked = np.arange(0, len(command), query_rows or len(command))
    return np.union1d(np.flatnonzero(np.diff(command)) + 1, asked)
