"""What a load cell that is slower than the log makes of a force."""

import numpy as np

from tendon_newton.data.recording import Array, Indices


def reading_stride(rate: float, time: Array) -> int:
    """Return how many rows lie between two readings of a cell at a rate [Hz]."""
    period = float(np.median(np.diff(time)))
    return max(1, round(1.0 / (rate * period)))


def first_reading(force: Array, rows: Indices, stride: int) -> int:
    """Find the row (modulo the stride) on which a linearly filled cell was really read.

    Between readings the second difference vanishes up to rounding, so that the readings are where
    it does not.

    Args:
        force: Recorded force [N], shape (T,).
        rows: Place of each recorded row on the even grid, shape (T,).
        stride: Rows per reading.
    """
    bend = np.abs(np.diff(force, 2))
    even = (np.diff(rows)[1:] == 1) & (np.diff(rows)[:-1] == 1)
    middle = rows[1:-1] % stride
    score = [float(np.sum(bend[even & (middle == phase)])) for phase in range(stride)]
    return int(np.argmax(score))


def fill_between_readings(force: Array, first: int, stride: int) -> Array:
    """Keep every ``stride``-th value from ``first`` on, fill in the others linearly, hold the ends.

    Args:
        force: Force at every row of the even grid [N], shape (..., T).
        first: First row with a reading.
        stride: Rows per reading.
    """
    rows = np.arange(force.shape[-1])
    knots = rows[first::stride]
    place = np.clip(np.searchsorted(knots, rows, side="right") - 1, 0, len(knots) - 2)
    left, right = knots[place], knots[place + 1]
    share = np.clip((rows - left) / (right - left), 0.0, 1.0)
    return force[..., left] * (1.0 - share) + force[..., right] * share
