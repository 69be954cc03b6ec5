"""Lags between channels, by cross-correlation."""

import numpy as np

from tendon_newton.data.recording import Array

ROUNDING = 1e-12  # share of a channel's squares that sums of them are off by

SMOOTHING = 0.04  # [s] above it, differences of an encoder are mostly its resolution


def lag_between(
    time: Array, reference: Array, late: Array, late_time: Array, reach: float = 0.1
) -> tuple[float, float, float]:
    """Find the delay of one channel behind another by cross-correlation.

    Args:
        time: Instants of the reference [s], shape (T,).
        reference: The channel that is on time, shape (T,).
        late: The channel in question, any unit, shape (S,).
        late_time: Instants of that channel [s], shape (S,).
        reach: Greatest delay to look for, either way [s].

    Returns:
        The delay [s], the correlation there [1] and the gain in correlation over no delay [1].
    """
    step = 1e-3  # resolution [s]: a tenth of the lags that matter
    grid = np.arange(max(time[0], late_time[0]) + reach, min(time[-1], late_time[-1]) - reach, step)
    if grid.size < 100:
        return 0.0, 0.0, 0.0
    measured = smooth(np.interp(grid, late_time, late), step)
    half = round(reach / step)
    wide: Array = grid[0] + step * np.arange(-half, grid.size + half)
    moved = smooth(np.interp(wide, time, reference), step)
    scores = correlations(moved, measured)[::-1]  # a channel that is late shows what was before
    best = int(np.argmax(scores))
    return step * (best - half), float(scores[best]), float(scores[best] - scores[half])


def smooth(values: Array, step: float) -> Array:
    """Average over a moving window: the same one on both channels keeps their delay."""
    width = int(SMOOTHING / step)
    return np.convolve(values, np.full(width, 1.0 / width), mode="valid")


def correlations(long: Array, short: Array) -> Array:
    """Correlate a channel with every stretch of another that is as long as the first.

    Args:
        long: The channel that is moved past the other, shape (T,).
        short: The other channel, shape (S,).

    Returns:
        Correlation [1] for each first row of a stretch, shape (T - S + 1,); zero where one of the
        two stands still.
    """
    count = short.size
    long, short = long - long.mean(), short - short.mean()
    sums, squares = (np.cumsum(np.append(0.0, x)) for x in (long, long**2))
    mean = (sums[count:] - sums[:-count]) / count
    spread = squares[count:] - squares[:-count] - count * mean**2
    scale = np.sqrt(np.maximum(spread, 0.0) * (short @ short))
    moves = spread > ROUNDING * squares[-1]
    across = np.correlate(long, short, mode="valid")
    return np.where(moves & (scale > 0.0), across / np.where(scale > 0.0, scale, 1.0), 0.0)
