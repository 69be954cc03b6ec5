r"""Does a joint shake: a line in the spectrum of its angle that stands out of the floor and stays.

A line is a peak of the periodogram that exceeds the median of its surroundings by `STANDS_OUT`;
noise does so in one of :math:`2^{20}` places. A line shakes where its envelope does not fall below
half of what it was for `STEADY` periods. Ringing with a damping ratio above 1.4 % falls below, and
so does every motion of fewer periods. What the command does likewise is no shaking of the joint,
unless the command answers the angle (`loop_closing`). Neither are counts, nor what readings that
come half a row late or early make of a motion.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tendon_newton.data.checks.measures import resolution
from tendon_newton.data.recording import Array, Mask

Waves = NDArray[np.complex128]
STANDS_OUT = 20.0  # [1] of the local floor's power
NEIGHBOURS = 40  # Places of the spectrum on either side that make the floor
LEAST_PERIODS = 6.0  # Periods in a log below which a frequency is not looked at
STEADY = 8.0  # Periods for which the envelope stays above half
COUNTS = 2.0  # Amplitude in counts of the reading below which nothing shakes
UNTIMED = 0.6  # Rows by which a reading may come beside its stamp [1]
SMOOTHED = 2.0  # Periods over which the speed of a motion is taken
DRIFTS = 0.25  # Share of a line's frequency by which its phase may turn beside it [1]
CANDIDATES = 4  # Greatest places of a spectrum that are looked at
APART = 0.1  # Share by which two lines differ at least [1]
SHORTEST = 4.0  # Part of a log that is looked at alone [s]
PAUSE = 5.0  # Rows that a gap must be worth to end a part [1]
STILL = 0.06  # Of the swing, within a tenth of a period [1]
HIGHEST = 0.4  # Of the rows' rate [1]; above, a line may be an image


@dataclass(frozen=True, kw_only=True)
class Evenly:
    """One joint of a log on an even grid."""

    step: float  # [s]
    command: Array  # [rad], shape (T,)
    angle: Array  # [rad], shape (T,)
    count: float = 0.0  # Resolution of the angle before it was put there [rad]
    start: float = 0.0  # Time of the first row [s]


@dataclass(frozen=True, kw_only=True)
class Shaking:
    """A line that stays."""

    frequency: float  # [Hz]
    amplitude: float  # Of the angle, median while it shakes [rad]
    command_amplitude: float  # Of the command at the same frequency [rad]
    above_floor: float  # Power of the line over that of its surroundings [1]
    rows: Mask  # Rows in which it shakes, shape (T,)
    stands: float  # Share of them in which the angle stands still [1]

    @property
    def first(self) -> int:
        """First row."""
        return int(np.argmax(self.rows))

    @property
    def last(self) -> int:
        """Last row."""
        return len(self.rows) - 1 - int(np.argmax(self.rows[::-1]))


def evenly(time: Array, command: Array, angle: Array) -> Evenly:
    """Put one joint on an even grid of the median step; a command is held, an angle drawn out."""
    step = float(np.median(np.diff(time)))
    grid: Array = time[0] + step * np.arange(int((time[-1] - time[0]) / step + 1e-6) + 1)
    held = np.maximum(np.searchsorted(time, grid + 1e-3 * step, side="right") - 1, 0)
    drawn = np.interp(grid, time, angle)
    return Evenly(
        step=step, command=command[held], angle=drawn, count=resolution(angle), start=float(time[0])
    )


def uninterrupted(time: Array) -> list[slice]:
    """Return the parts of a log between pauses of its clock that are long enough to look at."""
    steps = np.diff(time)
    edges = np.flatnonzero(steps > PAUSE * np.median(steps)) + 1
    parts = [slice(*ends) for ends in zip([0, *edges], [*edges, len(time)], strict=True)]
    return [rows for rows in parts if time[rows][-1] - time[rows][0] > SHORTEST]


def find_shakings(log: Evenly) -> list[Shaking]:
    """Find lines of an angle that stay, the greatest first."""
    found: list[Shaking] = []
    for pace, above in candidates(log):
        around = envelope(log.angle, pace, log.step)
        size = np.abs(around)
        size[size < UNTIMED * log.step * speed_of(log, pace)] = 0.0
        rows = steady_rows(size, COUNTS * log.count, STEADY / (pace * log.step))
        line = line_of(log, around, rows, pace, above) if rows.any() else None
        if line is not None and abs(line.frequency / pace - 1.0) < DRIFTS and is_new(line, found):
            found.append(line)
    return sorted(found, key=lambda line: -line.amplitude)


def is_new(line: Shaking, found: Sequence[Shaking]) -> bool:
    """Tell whether a line's frequency is apart from those that were found."""
    return all(abs(line.frequency / one.frequency - 1.0) >= APART for one in found)


def speed_of(log: Evenly, pace: float) -> Array:
    """Return how fast an angle moves beside a line [rad/s], shape (T,)."""
    width = min(max(1, round(SMOOTHED / (pace * log.step))), len(log.angle) - 1)
    padded = np.pad(log.angle, (width // 2, width - width // 2), mode="edge")
    return np.abs(padded[width:] - padded[:-width]) / (width * log.step)


def candidates(log: Evenly) -> list[tuple[float, float]]:
    """Return frequencies [Hz] that stand out in the log or in a part of it, and by how much."""
    count = len(log.angle)
    told: dict[int, tuple[float, float]] = {}
    length = count
    while length * log.step >= SHORTEST and length > 2 * NEIGHBOURS:
        for first in range(0, count - length + 1, max(1, length // 2)):
            power, floor = spectrum(log.angle[first : first + length], log.step)
            pace = np.arange(len(power)) / (length * log.step)
            usable = (pace >= LEAST_PERIODS / (length * log.step)) & (pace <= HIGHEST / log.step)
            usable &= power > STANDS_OUT * floor
            swing = np.where(usable, power / np.maximum(pace, 1e-9) ** 2, 0.0)
            for place in np.argsort(swing)[::-1][: min(CANDIDATES, int(usable.sum()))]:
                near = round(float(np.log(pace[place])) / APART)
                strength = float(power[place] / floor[place])
                if near not in told or told[near][1] < strength:
                    told[near] = float(pace[place]), strength
        length //= 2
    return sorted(told.values(), key=lambda one: -one[1])


def line_of(log: Evenly, around: Waves, rows: Mask, pace: float, above: float) -> Shaking:
    """Return a line whose envelope is known; its frequency is how fast its phase turns."""
    whole = np.flatnonzero(rows)
    turned = np.unwrap(np.angle(around[whole[0] : whole[-1] + 1]))
    inside = rows[whole[0] : whole[-1] + 1]
    steps = np.diff(turned)[inside[1:] & inside[:-1]]
    drift = float(np.median(steps)) / (2.0 * np.pi * log.step) if len(steps) else 0.0
    commanded = np.abs(envelope(log.command, pace, log.step))[rows]
    return Shaking(
        frequency=float(pace + drift),
        amplitude=float(np.median(np.abs(around)[rows])),
        command_amplitude=float(np.median(commanded)),
        above_floor=float(above),
        rows=rows,
        stands=standing(log, rows, pace, float(np.median(np.abs(around)[rows]))),
    )


def standing(log: Evenly, rows: Mask, pace: float, amplitude: float) -> float:
    """Return the share of rows about which an angle stands still for a tenth of a period [1].

    A sinusoid that moves by `STILL` of its swing then is told to stand for 0.12 to 0.2.
    """
    width = max(1, round(0.1 / (pace * log.step)))
    smooth = np.convolve(log.angle, np.full(width, 1.0 / width), mode="same")
    moves = np.abs(smooth[width:] - smooth[:-width])[rows[width:]]
    return float(np.mean(moves < STILL * 2.0 * amplitude)) if len(moves) else 0.0


def spectrum(signal: Array, step: float) -> tuple[Array, Array]:
    """Return the periodogram of a signal's changes under a Hann window, and its local floor.

    Changes, since steps and slow motions of an angle have a power that falls with frequency.
    """
    changes = np.diff(signal, append=signal[-1]) / step
    power = np.abs(np.fft.rfft((changes - changes.mean()) * np.hanning(len(changes)))) ** 2
    padded = np.pad(power, NEIGHBOURS, mode="reflect" if len(power) > NEIGHBOURS else "edge")
    views = np.lib.stride_tricks.sliding_window_view(padded, 2 * NEIGHBOURS + 1)
    floor = np.median(views, axis=1)
    return power, np.maximum(floor, 1e-12 * power.max(initial=1e-300))


def envelope(signal: Array, pace: float, step: float) -> Waves:
    """Return twice the signal about a frequency [Hz], moved to 0 Hz, complex, shape (T,).

    The band is half the frequency wide on either side: a step is forgotten after two periods.
    """
    count = len(signal)
    pad = min(count - 1, round(2.0 / (pace * step)))
    padded = np.pad(signal - signal.mean(), pad, mode="reflect", reflect_type="odd")
    freqs = np.fft.fftfreq(len(padded), step)
    window = np.exp(-0.5 * ((freqs - pace) / (0.25 * pace)) ** 2)
    analytic = 2.0 * np.fft.ifft(np.fft.fft(padded) * window)[pad : pad + count]
    return analytic * np.exp(-2.0j * np.pi * pace * step * np.arange(count))


def steady_rows(size: Array, least: float, length: float) -> Mask:
    """Tell in which rows an envelope stays above a level and half of what it was, for long."""
    rows = np.zeros(len(size), dtype=np.bool_)
    first, most = 0, 0.0
    for row in range(len(size) + 1):
        level = size[row] if row < len(size) else 0.0
        if level < max(least, 0.5 * most):
            if row - first >= length:
                rows[first:row] = True
            first, most = row + 1, 0.0
        most = max(most, level if level >= least else 0.0)
    return rows
