"""Rate and acceleration of a shaft whose angle was measured, by septics through its rows."""

from dataclasses import replace

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy.interpolate import CubicHermiteSpline

from tendon_newton.data.checks.measures import encoder_count
from tendon_newton.data.recording import Array, Recording
from tendon_newton.data.root_mean_square import rms
from tendon_newton.simulation.hosts.timeline import Timeline, make_timeline

REACHES = (4, 6, 8, 11, 16, 22, 32)
"""Rows on either side of a window's own: by their power 5/2 the noise of an acceleration falls."""
WINDOWS = (*((1, reach) for reach in REACHES), *((2**k, r) for k in range(1, 5) for r in (22, 32)))
"""Rows whose means are fitted, and how many of these on either side: 64 ms to 1 s at 1 kHz."""
ORDER = 7  # A quintic's windows cut 0.1 % off an acceleration, a septic's 0.01 %
AT_ONCE = 4096  # Rows whose windows are fitted at once: several hundred kB for each power
WIDER = 1.05
"""Growth of what a width leaves beyond which it cuts off corners and not only noise [1]."""
LEAST_STEP = 0.5  # Share of the usual step within which a row tells little more than another [1]
LEAST_PART = 0.01  # Share of an interval by which a turn keeps away from the rows around it [1]
MOST_LOST = 3  # Rows that are missing in a row and may be filled in
INSTANT = 1.0e-3  # The same by which a shaft is before and behind its turn [1]


def led_timeline(recording: Recording) -> Timeline:
    """Return the rows of a path that a shaft is led along, with its rates and accelerations.

    Where it turns back between two rows there are two more: dry friction jumps there.
    """
    path = make_timeline(replace(recording, command=recording.motor_position))
    rate, acceleration = motion_between_gaps(path)
    (turns,) = np.nonzero(rate[:-1] * rate[1:] < 0.0)
    parts = np.clip(rate[turns] / (rate[turns] - rate[turns + 1]), LEAST_PART, 1.0 - LEAST_PART)
    steps = np.diff(path.time)[turns]
    about = [path.time[turns] + (parts + side * INSTANT) * steps for side in (-1.0, 1.0)]
    time = np.sort(np.concatenate([path.time, *about]))
    angle, *motion = (
        np.interp(time, path.time, values) for values in (path.command[:, 0], rate, acceleration)
    )
    return Timeline(
        time=time,
        command=angle[:, None],
        measured=np.searchsorted(time, path.time[path.measured]),
        trusted=path.trusted,
        motion=np.column_stack(motion),
    )


def motion_between_gaps(path: Timeline) -> tuple[Array, Array]:
    """Return rate [rad/s] and acceleration [rad/s2] of a path, (S,); straight lines over gaps.

    No window reaches over a gap: what was filled in there is no motion.
    """
    (gaps,) = np.nonzero(np.diff(path.measured) > MOST_LOST + 1)
    firsts = [0, *path.measured[gaps + 1].tolist()]
    ends = [*(path.measured[gaps] + 1).tolist(), len(path.time)]
    spans = [slice(first, end) for first, end in zip(firsts, ends, strict=True)]
    found = [motion_of(path.time[span], path.command[span, 0]) for span in spans]
    known = np.concatenate([path.time[span] for span in spans])
    rate, acceleration = (
        np.interp(path.time, known, np.concatenate(each)) for each in zip(*found, strict=True)
    )
    return rate, acceleration


def motion_of(time: Array, angle: Array) -> tuple[Array, Array]:
    """Return the rate [rad/s] and the acceleration [rad/s2] of an angle [rad], shapes (T,).

    They are those of a septic through the rows around each, as many as leave no more of the angle
    than fewer do, or than its encoder's counts, less one step, since noise averages out over
    rows and what is cut off does not. Nothing is shifted in time. Of rows that follow each other
    much faster than most, one in a while is taken, so that a window is as long everywhere. A long
    window is one of means over some rows each.

    Source: Savitzky and Golay, Smoothing and differentiation of data (1964), with as many rows.
    """
    kept = rows_apart(time, LEAST_STEP * float(np.median(np.diff(time))))
    if len(kept) < 2 * REACHES[0] + 1:
        return np.gradient(angle, time), np.zeros_like(angle)
    counted = encoder_count(angle) / np.sqrt(12.0)
    passing: list[tuple[Array, Array, float]] = []
    for rows, reach in WINDOWS:
        if (2 * reach + 1) * rows > len(kept):
            break
        at, mean = (means(values[kept], rows) for values in (time, angle))
        place, *motion, left = septics(at, mean, reach)
        if rows > 1:
            inner = kept[rows // 2 : len(at) * rows - rows // 2]
            path = CubicHermiteSpline(at, place, motion[0])
            left = rms(angle[inner] - path(time[inner]))
        usual = [known for *_, known in passing]
        if not usual or left <= WIDER * max(counted, float(np.median(usual))):
            rate, acceleration = (np.interp(time, at, values) for values in motion)
            passing.append((rate, acceleration, left))
    rate, acceleration, _ = passing[max(len(passing) - 2, 0)]
    return rate, acceleration


def means(values: Array, rows: int) -> Array:
    """Return the means over so many rows after each other; the last ones may be left out."""
    whole = len(values) // rows * rows
    return values[:whole].reshape(-1, rows).mean(axis=1)


def rows_apart(time: Array, least: float) -> list[int]:
    """Return the first row and each that is so long [s] after the last of them."""
    kept = [0]
    for row, instant in enumerate(time):
        if instant - time[kept[-1]] >= least:
            kept.append(row)
    return kept


def septics(time: Array, angle: Array, reach: int) -> tuple[Array, Array, Array, float]:
    """Fit a septic to each row and those within a reach; near the ends, to as many.

    Returns:
        Angles, rates and accelerations in the rows, shapes (T,), and the noise [rad] that is left.
    """
    rows, width = np.arange(len(time)), 2 * reach + 1
    windows = np.clip(rows - reach, 0, len(time) - width)
    scale = (time[-1] - time[0]) * reach / (len(time) - 1)
    found, share = np.empty((len(time), ORDER + 1)), np.empty(len(time))
    for some in np.array_split(rows, max(1, len(time) // AT_ONCE)):
        since = sliding_window_view(time, width)[windows[some]] - time[some, None]
        about = sliding_window_view(angle, width)[windows[some]] - angle[some, None]
        powers = np.cumprod(np.stack([since / scale] * ORDER), axis=0)
        terms = np.concatenate([np.ones((1, *since.shape)), powers])
        inverse = np.linalg.inv(np.einsum("itw,jtw->tij", terms, terms, optimize=True))
        found[some] = np.einsum("tij,jtw,tw->ti", inverse, terms, about, optimize=True)
        share[some] = inverse[:, 0, 0]
    left = rms(found[:, 0] / np.sqrt(1.0 - share))
    return angle + found[:, 0], found[:, 1] / scale, 2.0 * found[:, 2] / scale**2, left
