"""Signed registers that somebody read as unsigned, and clocks that run late."""

import numpy as np

from tendon_newton.data.recording import Array

REGISTER_BITS = (16, 32)

# a wrapped register holds values near both ends of its range and none between. A servo's own limits
# keep within the outer tenth (885 of 65536 for duty, a few thousand for speed)
OUTER_FRACTION = 0.1
# a wrapped register passes through zero, so its highest values lie close below the full range
TOP_FRACTION = 0.99

ROUNDING = 1e-12  # share of a channel's squares that sums of them are off by

SMOOTHING = 0.04  # [s] above it, differences of an encoder are mostly its resolution


def wrap_period(values: Array, unit: float | None = None) -> float | None:
    """Find the span by which negative values of a register were lifted [channel's unit].

    Args:
        values: The channel as logged, shape (T,).
        unit: Value of one count; estimated as the least difference between levels unless given.

    Returns:
        ``2**16`` or ``2**32`` counts where the channel is wrapped, else ``None``.
    """
    levels = np.unique(values)
    if levels.size < 3 or levels[0] < 0.0:
        return None
    unit = float(np.diff(levels).min()) if unit is None else unit
    counts = levels / unit
    if np.abs(counts - np.round(counts)).max() > 1e-3:  # not on a grid: no register
        return None
    for bits in REGISTER_BITS:
        full = 2.0**bits
        low, high = OUTER_FRACTION * full, (1.0 - OUTER_FRACTION) * full
        outer = np.all((counts <= low) | (counts >= high))
        if outer and TOP_FRACTION * full <= counts[-1] < full:
            return full * unit
    return None


def unwrap_register(values: Array, period: float) -> Array:
    """Give a wrapped channel its negative values back."""
    return np.where(values > 0.5 * period, values - period, values)


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
