"""Time stamps that do not increase: a clock that restarted, rows out of order, doubled stamps."""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
OUT_OF_ORDER = 0.5  # [s] a row that came late is overtaken by no more; a clock restarts farther
OFTEN = 3  # Restarts of a clock from which rows are rather out of order
GAP = 3.0  # Steps that one step of an even clock may last [1]
FEW = 0.05  # Share of the rows that may be left out of a log [1]


STEPS = {
    "seconds": ("s", 1.0),
    "nanoseconds": ("ns", 1e-9),
    "microseconds": ("us", 1e-6),
    "milliseconds": ("ms", 1e-3),
    "minutes": ("min", 60.0),
    "hours": ("h", 3600.0),
    "days": ("d", 86400.0),
}
"""Unit of somebody's stamps -> how a mapping writes it, and its size [s]."""
TIME_STEP_RANGE = (5e-5, 0.5)
"""Credible median steps of the time column [s]. Shorter ones are above any servo bus (20 kHz),
longer ones slower than any motion of a finger. 80 Hz written in milliseconds is a step of 12.5."""
USUAL_STEP = 0.01  # [s] of logs of servos, within a factor of ten or so


def unit_of_step(step: float) -> str:
    """Return the unit in which a step between rows is the most usual one, and its mend.

    Args:
        step: Median step, in the unit in question.
    """
    unit = min(STEPS, key=lambda name: abs(np.log(step * STEPS[name][1] / USUAL_STEP)))
    word, _ = STEPS[unit]
    rows = "" if step != 1.0 else ", or row numbers (rate = ..., rows a second, in place of t)"
    return f'{unit} (unit = "{word}" in a mapping){rows}'


def step_fault(time: Array, scale: float = 1.0) -> str | None:
    """Say in which unit stamps rather are, whose steps no servo is read at; None where one is.

    Args:
        time: Stamps [s], shape (T,).
        scale: Size [s] of the unit that they are said to be in.
    """
    with np.errstate(over="ignore"):  # the step from -1e308 to 1e308 s is infinite, and refused
        step = float(np.median(np.diff(time)))
    if step <= 0.0 or TIME_STEP_RANGE[0] <= step <= TIME_STEP_RANGE[1]:
        return None
    unit = unit_of_step(step / scale)
    return f"t must be in seconds; its median step is {step:g} s, and its numbers look like {unit}"


def stamp_fault(time: Array) -> str | None:
    """Say what is wrong where stamps do not increase, and what mends it; None where they do.

    Args:
        time: Stamps [s], finite, shape (T,).
    """
    steps = np.diff(time)
    if not (steps <= 0.0).any():
        return None
    row = int(np.flatnonzero(steps <= 0.0)[0]) + 1
    at = f"row {row} is {time[row]:.6f} s after {time[row - 1]:.6f} s"
    if (steps < 0.0).all():
        return f"{at}; the last row comes first: sort the rows by t"
    if (steps == 0.0).all():
        return (
            f"all {time.size} rows have the stamp {time[0]:.6g}: map another column as t, or say "
            "how many rows a second has (rate = ...) in place of it"
        )
    if shuffled(time):
        count = int((steps < 0.0).sum())
        return f"{at}; {count} of {time.size} rows come before the one above: sort them by t"
    if restarts := restart_rows(time):
        row = restarts[0]
        more = f", and {len(restarts) - 1} times more" if len(restarts) > 1 else ""
        return (
            f"row {row} is {time[row]:.6f} s after {time[row - 1]:.6f} s{more}: the clock "
            "restarted, cut the file there"
        )
    doubled = int((steps == 0.0).sum())
    if doubled > FEW * time.size:
        changes = np.flatnonzero(steps) + 1  # the first and the last stamp may be cut
        first, last = changes[[0, -1]] if changes.size > 1 else (0, time.size - 1)
        rate = (last - first) / max(time[last] - time[first], 1e-12)
        return (
            f"{at}; {doubled} of {time.size} rows have the stamp of the row before: their clock is "
            f"too coarse, say how many rows a second has (rate = {rate:.4g}) in place of t"
        )
    kind = "have the stamp of the row before" if doubled else "come out of order"
    count = doubled or int((steps < 0.0).sum())
    return f"{at}; {count} of {time.size} rows {kind}: leave them out"


def shuffled(time: Array) -> bool:
    """Tell whether stamps are those of one clock, in another order than they came."""
    steps = np.diff(np.sort(time))
    even = steps.min() > 0.5 * np.median(steps) and steps.max() < GAP * np.median(steps)
    return bool(even and len(restart_rows(time)) >= OFTEN)


def restart_rows(time: Array) -> list[int]:
    """Return the rows at which a clock begins again."""
    return [int(k) + 1 for k in np.flatnonzero(np.diff(time) < -OUT_OF_ORDER)]


def increasing_parts(time: Array) -> list[NDArray[np.intp]]:
    """Return the rows of each stretch of one clock, without those whose stamp is no later one.

    Args:
        time: Stamps [s], finite, shape (T,).

    Returns:
        Rows of each stretch; none of those with a clock so coarse that too many rows would go.
    """
    if shuffled(time) or (np.diff(time) < 0.0).all():
        return [np.argsort(time)]
    edges = [0, *restart_rows(time), time.size]
    parts: list[NDArray[np.intp]] = []
    for first, end in pairwise(edges):
        own = time[first:end]
        latest = np.maximum.accumulate(np.r_[-np.inf, own[:-1]])
        rows = first + np.flatnonzero(own > latest)
        if rows.size >= (1.0 - FEW) * own.size:
            parts.append(rows)
    return parts
