"""Errors of a prediction against a measurement, and its delay with a standard error.

The delay has two answers, since a wrong size can look like a wrong time. The shift at
which the *forces* correlate best also moves where a prediction is wrong for a while. A release that
is guessed too steep by 3 N runs ahead of a slow one, although no edge of it does. The shift at
which their *changes* over a tenth of a second correlate best hangs on the moments at which a force
turns.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tendon_newton.data.recording import Array
from tendon_newton.data.root_mean_square import rms
from tendon_train.actuator.prediction import ForcePrediction


@dataclass(frozen=True, kw_only=True)
class Score:
    """Errors of a model on some recordings."""

    rmse: float  # Root mean square error [N]
    error_spread: float  # Standard deviation of the absolute error [N]: the paper's error bars
    bias: float  # Mean of measured minus predicted [N]
    rows: int  # Number of compared rows


def score(predictions: Sequence[ForcePrediction]) -> Score:
    """Pool the errors of a model over all rows of some recordings."""
    error = np.concatenate([p.error for p in predictions])
    return Score(
        rmse=rms(error),
        error_spread=float(np.std(np.abs(error))),
        bias=float(np.mean(error)),
        rows=error.size,
    )


STEP = 0.0125  # Between two instants at which forces are compared [s]: a row at 80 Hz
REACH = 80  # Farthest that one force is shifted against the other, in steps: a second
CHANGE = 4
"""Half of the time over which a change is taken, in steps. A tenth of a second in all are two
readings of a load cell of 20 Hz, between which the log has a line."""
BLOCK = 80  # Steps that are drawn together: errors of a force last for about a second
DRAWS = 200  # Draws of a bootstrap; its standard deviation is then right to 5 %
LEAST_MOTION = 0.1
"""Standard deviation of a force, or of its change, below which a lag means nothing [N]."""


@dataclass(frozen=True, kw_only=True)
class Lag:
    """Delay of a prediction behind the measurement."""

    shift: float  # [s]; negative where the prediction runs ahead
    error: float  # Standard error, from drawing whole seconds of the recordings anew [s]


@dataclass(frozen=True, kw_only=True)
class Moments:
    """Sums over each block of two signals, for every shift; S = 2 REACH + 1."""

    product: Array  # Measured times shifted predicted [N^2], shape (B, S)
    power: Array  # Square of the shifted predicted [N^2], shape (B, S)


def lag(predictions: Sequence[ForcePrediction], *, of_changes: bool) -> Lag | None:
    """Return the lag of a model on some recordings, by its forces or by their changes.

    None where recordings are shorter than three seconds, where forces hardly move, or where no
    shift within a second fits best: then the signals differ in shape, not in time.
    """
    found = [m for p in predictions if (m := moments(p, of_changes=of_changes)) is not None]
    if not found:
        return None
    product = np.concatenate([m.product for m in found])
    power = np.concatenate([m.power for m in found])
    shift = best_shift(product.sum(axis=0), power.sum(axis=0))
    if shift is None:
        return None
    rng = np.random.default_rng(0)
    drawn = rng.multinomial(len(product), np.full(len(product), 1.0 / len(product)), DRAWS)
    shifts = [best_shift(*sums) for sums in zip(drawn @ product, drawn @ power, strict=True)]
    known = [s for s in shifts if s is not None]
    if 2 * len(known) < DRAWS:
        return None
    return Lag(shift=STEP * shift, error=STEP * float(np.std(known)))


def moments(prediction: ForcePrediction, *, of_changes: bool) -> Moments | None:
    """Return what a recording says about every shift; None if that is nothing."""
    time = prediction.time
    grid = np.arange(time[0], time[-1], STEP) if time.size else time
    if grid.size < 3 * REACH:
        return None
    signals = [np.interp(grid, time, s) for s in (prediction.measured, prediction.predicted)]
    if of_changes:
        signals = [s[2 * CHANGE :] - s[: -2 * CHANGE] for s in signals]
    if min(map(np.std, signals)) < LEAST_MOTION:
        return None
    measured, predicted = (s - s.mean() for s in signals)
    shifted = np.lib.stride_tricks.sliding_window_view(predicted, 2 * REACH + 1)
    middle = measured[REACH : REACH + len(shifted), None]
    starts = np.arange(0, len(shifted), BLOCK)
    return Moments(
        product=np.add.reduceat(middle * shifted, starts, axis=0),
        power=np.add.reduceat(shifted**2, starts, axis=0),
    )


def best_shift(product: Array, power: Array) -> float | None:
    """Return the shift with the greatest correlation, in steps, between them by a parabola."""
    fits = product / np.sqrt(np.maximum(power, 1.0e-12))
    best = int(np.argmax(fits))
    if best in (0, fits.size - 1):
        return None
    before, at, after = fits[best - 1 : best + 2]
    bend = before - 2.0 * at + after
    return best - REACH + (0.0 if bend >= 0.0 else float(0.5 * (before - after) / bend))
