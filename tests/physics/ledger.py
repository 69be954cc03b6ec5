"""The books of a slider on a spring: what its tendon carries, and where that force and work go."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.interpolate import make_interp_spline

from tendon_newton.data.recording import Array

DEGREE = 5  # Of the splines in a smooth piece
DAMPING = 5.0  # N s/m
MASS = 0.05  # kg
STIFFNESS = {"spring_weak": 200.0, "spring_strong": 800.0}  # N/m


@dataclass(frozen=True, kw_only=True)
class Books:
    """One run of a spring bench, row by row."""

    bench: str
    time: Array  # [s], shape (T,)
    slide: Array  # [m], shape (T,)
    # Tension that the load cell reports [N], shape (T,): that just after a row's instant
    force: Array
    jumps: Array  # Rows at which the force may jump, because a command or an answer changes
    speed: Array | None = None  # Of the slide [m/s], shape (T,); by default its spline's
    read_before: bool = False  # Whether a row's force is that just before its instant

    @property
    def stretches(self) -> Sequence[slice]:
        """Rows from one jump to the next, both included: position and speed have no jumps."""
        edges = np.unique(np.concatenate([[0], self.jumps, [len(self.time) - 1]]))
        return [slice(first, last + 1) for first, last in pairwise(edges)]

    def read(self, rows: slice) -> slice:
        """Return the rows of a stretch whose force belongs to it; that of the other end does not.

        Of two neighbouring stretches, one owns the row between them: each row is judged once.
        """
        skipped = int(self.read_before)
        return slice(rows.start + skipped, rows.stop - 1 + skipped)

    def pieces(self, rows: slice) -> list[tuple[slice, slice]]:
        """Return the smooth pieces of a stretch: the rows of its motion, and of its force.

        A string that comes loose or is caught between two rows bends the force there.
        """
        read = self.read(rows)
        loose = self.force[read] == 0.0
        bends = read.start + 1 + np.flatnonzero(loose[1:] != loose[:-1])
        moves = pairwise([rows.start, *bends, rows.stop])
        reads = pairwise([read.start, *bends, read.stop])
        return [(slice(*m), slice(*r)) for m, r in zip(moves, reads, strict=True)]

    def motion(self, rows: slice) -> tuple[Array, Array]:
        """Return speed [m/s] and acceleration [m/s2] in a smooth piece."""
        time = self.time[rows]
        degree = min(DEGREE, len(time) - 1)
        if self.speed is not None:
            return self.speed[rows], make_interp_spline(time, self.speed[rows], k=degree)(time, 1)
        spline = make_interp_spline(time, self.slide[rows], k=degree)
        return spline(time, 1), spline(time, 2)

    def mean_force(self, row: int) -> float:
        """Return what moved the slider from a row to the next [N]: its momentum, drag and spring.

        The spring's part by Hermite's rule, exact for a slide of third degree.
        """
        ends = slice(row, row + 2)
        (step,) = np.diff(self.time[ends])
        slide, gain = self.slide[ends], float(np.diff(self.speed[ends])[0])
        passed = 0.5 * step * slide.sum() - step**2 / 12.0 * gain
        lost = DAMPING * float(np.diff(slide)[0]) + STIFFNESS[self.bench] * passed
        return float((MASS * gain + lost) / step)

    def imbalance(self) -> Array:
        """Return F - (m x'' + c x' + k x) [N] of each row, none left out, shape (T - 1,).

        Each row is judged in its own smooth piece. Where a piece is one row's interval, because the
        force jumps in every row, the balance of momentum takes the place of the acceleration.
        A row that alone is slack, or alone is not, has none of its own and is nan.
        """
        left = []
        for rows in self.stretches:
            for moves, reads in self.pieces(rows):
                left.append(self.piece_imbalance(moves, reads))
        return np.concatenate(left)

    def piece_imbalance(self, moves: slice, reads: slice) -> Array:
        """Return the same of one smooth piece."""
        count = moves.stop - moves.start
        if count == 1:
            return np.full(1, np.nan)
        if count == 2 and reads.stop - reads.start == 1:
            return self.force[reads] - self.mean_force(moves.start)
        speed, acceleration = self.motion(moves)
        carried = MASS * acceleration + DAMPING * speed
        carried += STIFFNESS[self.bench] * self.slide[moves]
        first = reads.start - moves.start
        return self.force[reads] - carried[first : first + reads.stop - reads.start]

    def blows(self) -> Array:
        """Return how far [N] the mean force is outside its ends, in rows in which the force bends.

        A string that is caught hard, or comes loose with a jump, hides between two rows.
        """
        out = [0.0]
        for rows in self.stretches:
            for moves, _ in self.pieces(rows)[1:]:
                ends = self.force[moves.start - 1 : moves.start + 1]
                mean = self.mean_force(moves.start - 1)
                out.append(max(ends.min() - mean, mean - ends.max(), 0.0))
        return np.array(out)

    def work(self) -> tuple[float, float]:
        """Return the tension's work [J], and what of it is stored or lost to damping [J]."""
        done = kept = 0.0
        for rows in self.stretches:
            time, slide = self.time[rows], self.slide[rows]
            degree = min(DEGREE, len(time) - 1)
            # of the slide itself: in a first-order step the speed is ahead of it
            speed = make_interp_spline(time, slide, k=degree)(time, 1)
            power = make_interp_spline(time, self.whole_force(rows) * speed, k=degree)
            lost = make_interp_spline(time, DAMPING * speed**2, k=degree)
            done += float(power.integrate(time[0], time[-1]))
            kept += float(lost.integrate(time[0], time[-1]))
            kept += 0.5 * MASS * float(speed[-1] ** 2 - speed[0] ** 2)
            kept += 0.5 * STIFFNESS[self.bench] * float(slide[-1] ** 2 - slide[0] ** 2)
        return done, kept

    def whole_force(self, rows: slice) -> Array:
        """Return the force of a stretch [N], at the end that was not read from its neighbours."""
        read = self.force[self.read(rows)]
        known = min(3, len(read))
        weights = {1: [1.0], 2: [2.0, -1.0], 3: [3.0, -3.0, 1.0]}[known]
        if self.read_before:
            return np.concatenate([[np.dot(weights, read[:known])], read])
        return np.concatenate([read, [np.dot(weights, read[::-1][:known])]])


def one_step(rate: float) -> Array:
    """Return 0.5 rad, and 2.5 rad from 0.1 s to 0.6 s, at so many rows a second [rad]."""
    return np.where(np.arange(round(0.6 * rate)) < round(0.1 * rate), 0.5, 2.5)


def random_steps(rate: float) -> Array:
    """Return 12 s of levels within 0.5 to 5 rad, each held 0.4 s [rad]."""
    levels = np.random.default_rng(20260101).uniform(0.5, 5.0, 30)
    return np.repeat(levels, round(0.4 * rate))


def jumps_of(command: Array, query_rows: int | None = None) -> Array:
    """Return the rows from which on another command holds, and those at which a network answers."""
    asked = np.arange(0, len(command), query_rows or len(command))
    return np.union1d(np.flatnonzero(np.diff(command)) + 1, asked)
