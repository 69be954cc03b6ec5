"""What columns tell: steps, noise, where one rests, its lag behind another, and the supply."""

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from tendon_newton.data.formats.csv_file import named_by_tendon
from tendon_newton.data.recording import Array, Indices, Mask, Recording

ROUNDING = 1e-9  # Share of a column's size below which two of its values are one [1]
NORMAL = 0.6745  # Median size of a normal variable in standard deviations [1]
STILL = 1.0e-7  # Change of an angle [rad] that is rounding
USUAL_COUNT = 2.0 * np.pi / 4096.0  # Of the encoders of most servos [rad]
SUMS_ROUNDING = 1e-12  # Share of a channel's squares that sums of them are off by [1]
SMOOTHING = 0.04  # [s] above it, differences of an encoder are mostly its resolution
NOISY = 0.5  # Share of third differences that turn about [1]; those of white noise are 0.8
SHOWN_ROWS = 3  # Stretches of rows that are written out
FEWEST_READINGS = 8.0  # Readings [1] below which nothing tells noise from a supply that moves
LIKE_NOISE = 4.0  # Standard errors by which the variance of noise alone may differ [1]
BEND = 0.1  # Share of a typical slope by which a new reading changes the slope at least [1]


def resolution(values: Array) -> float:
    """Return the least distance of two values of a column: its count; 0 where it has one value."""
    levels = np.unique(values)
    gaps = np.diff(levels)
    gaps = gaps[gaps > ROUNDING * max(abs(levels[0]), abs(levels[-1]))]
    return float(gaps.min()) if gaps.size else 0.0


def noise_of(values: Array) -> float:
    """Return the noise of a column by its third differences, which a smooth motion hardly has."""
    if len(values) < 8:
        return 0.0
    return float(np.median(np.abs(np.diff(values, 3)))) / NORMAL / float(np.sqrt(20.0))


def rest_band(values: Array) -> float:
    """Return how far a column that rests goes: some of its counts, or its noise."""
    return max(3.0 * resolution(values), 6.0 * noise_of(values))


def scatters(values: Array) -> bool:
    """Tell whether a column has noise: its bends turn about row by row, as no motion's do."""
    read = values[np.diff(values, prepend=np.nan) != 0.0]
    bends = np.diff(read, 3)
    return bends.size > 1 and bool(np.mean(bends[1:] * bends[:-1] < 0.0) > NOISY)


def calm(values: Array) -> Array:
    """Return the median of five neighbours, shape (T,): single and double rows that are off go."""
    if len(values) < 5:
        return values
    return np.median(sliding_window_view(np.pad(values, 2, mode="edge"), 5), axis=1)


def most_around(values: Array, reach: int) -> Array:
    """Return the greatest value within a reach of rows on either side, shape (T,)."""
    padded = np.pad(values, reach, mode="edge")
    return sliding_window_view(padded, 2 * reach + 1).max(axis=1)


def stretches(mask: Mask) -> Indices:
    """Return the first row of each stretch of true rows and the row after its last, (N, 2)."""
    edges = np.flatnonzero(np.diff(np.r_[False, mask, False]))
    return edges.reshape(-1, 2)


def rows_text(mask: Mask, time: Array) -> str:
    """Write how many rows, their share and when: ``3 of 900 rows (0.33 %, t = 0.4, 2-2.1 s)``."""
    found = stretches(mask)
    ends = [(time[a], time[b - 1]) for a, b in found[:SHOWN_ROWS]]
    words = [f"{a:.6g}" if a == b else f"{a:.6g}-{b:.6g}" for a, b in ends]
    more = " and more" if len(found) > SHOWN_ROWS else ""
    share = f"{100.0 * mask.mean():.2g} %, t = {', '.join(words)} s{more}"
    return f"{int(mask.sum())} of {mask.size} rows ({share})"


def place_of(column: str) -> int:
    """Return the number of the servo that a column is of."""
    return int(column.rpartition("_")[2]) if column[-1].isdigit() else 0


def names_of(recording: Recording, column: str) -> list[str]:
    """Return the names of a column, one for each tendon."""
    return list(named_by_tendon(column, recording.motor_position))


def encoder_noise(angle: Array) -> float:
    """Return the noise [rad] of one encoder's readings, shape (T,).

    It is that of its counts, or of its scatter if it has none.
    """
    if np.abs(np.diff(angle)).max(initial=0.0) <= STILL:  # an angle that never changes has no count
        return USUAL_COUNT / np.sqrt(12.0)
    count = encoder_count(angle)
    return count / np.sqrt(12.0) if count > 0.0 else difference_noise(angle)


def encoder_count(angle: Array) -> float:
    """Return what an angle changes by a multiple of [rad], shape (T,); 0 where it shows no such.

    An even motion shows none: it changes by the same in every row.
    """
    moves = np.abs(np.diff(angle))
    moving = moves[moves > STILL]
    if len(moving) == 0:
        return 0.0
    step = float(np.quantile(moving, 0.02))
    few = moving[moving < 10.5 * step] / step
    counts = np.round(few)
    even = len(moving) == len(moves) and np.ptp(counts) == 0.0
    return step if not even and np.mean(np.abs(few - counts) < 0.05) > 0.9 else 0.0


def difference_noise(signal: Array) -> float:
    """Return the noise of a smooth signal from its second differences, shape (T,), robustly."""
    bend = np.diff(signal, 2)
    return float(1.4826 * np.median(np.abs(bend - np.median(bend))) / np.sqrt(6.0))


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
    moves = spread > SUMS_ROUNDING * squares[-1]
    across = np.correlate(long, short, mode="valid")
    return np.where(moves & (scale > 0.0), across / np.where(scale > 0.0, scale, 1.0), 0.0)


def supply_of(recording: Recording) -> Array | None:
    r"""Return the supply voltage [V], shape (T,), without the scatter of its register.

    A converter that samples within the period of a PWM scatters by several percent, and a simulated
    motor follows every reading. Readings :math:`V_k + e_k` of a supply that walks,
    :math:`V_{k+1} = V_k + w_k`, differ over k of them by :math:`2 \sigma_e^2 + k \sigma_w^2` in the
    mean square. Where they scatter as noise alone does, their mean is the supply. Else it is an
    exponential mean over both sides, the best for such a walk; readings without noise stay.

    Source: Muth, Optimal properties of exponentially weighted forecasts of time series with
    permanent and transitory components, J. Am. Stat. Assoc. 55 (1960).
    """
    voltage = recording.voltage
    if voltage is None:
        return None
    rows = rows_of_a_reading(recording.time, voltage)
    readings = len(voltage) / rows
    if readings < FEWEST_READINGS:
        return voltage
    near, far = (
        0.5 * float(np.mean((voltage[k:] - voltage[:-k]) ** 2)) for k in (2 * rows, 4 * rows)
    )
    noise, excess = 2.0 * near - far, float(np.var(voltage)) - near
    if excess <= near * LIKE_NOISE / np.sqrt(readings):
        return np.full_like(voltage, voltage.mean())
    if noise <= 0.0:
        return voltage
    ratio = 6.0 * excess / readings / noise  # a walk of n steps varies by n / 6 of a step
    kept = 1.0 + 0.5 * ratio - np.sqrt(ratio + 0.25 * ratio**2)
    return two_sided_mean(voltage, kept ** (1.0 / rows))


def rows_of_a_reading(time: Array, voltage: Array) -> int:
    """Return over how many rows a reading is drawn out to the next, at least; half where held."""
    slopes = np.diff(voltage) / np.diff(time)
    bends = np.abs(np.diff(slopes)) > BEND * np.sqrt(np.mean(slopes**2))
    return max(1, round(len(voltage) / (1 + int(bends.sum()))))


def two_sided_mean(signal: Array, kept: float) -> Array:
    """Return means whose weights fall by a share [1] from row to row on both sides, shape (T,)."""
    far = np.arange(1 - len(signal), len(signal))
    weights = np.fft.rfft(np.float64(kept) ** np.abs(far), 3 * len(signal))

    def spread(values: Array) -> Array:
        whole = np.fft.irfft(np.fft.rfft(values, 3 * len(signal)) * weights, 3 * len(signal))
        return whole[len(signal) - 1 :][: len(signal)]

    return spread(signal) / spread(np.ones_like(signal))
