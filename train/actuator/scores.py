"""How far a prediction is from a measurement."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from tendon_newton.recording import Array
    from train.actuator.prediction import Prediction

LONGEST_LAG = 1.0
"""Farthest that one signal is shifted against the other [s]."""
LEAST_MOTION = 0.1
"""Standard deviation of a force below which a lag means nothing [N]."""


@dataclass(frozen=True, kw_only=True)
class Score:
    """Errors of a model on some recordings."""

    rmse: float
    """Root mean square error [N]."""
    error_spread: float
    """Standard deviation of the absolute error [N]: the paper's error bars."""
    bias: float
    """Mean of measured minus predicted [N]."""
    rows: int
    """Rows compared."""


def score(predictions: Sequence[Prediction]) -> Score:
    """Pool the errors of a model over all rows of some recordings."""
    error = np.concatenate([p.error for p in predictions])
    return Score(
        rmse=float(np.sqrt(np.mean(error**2))),
        error_spread=float(np.std(np.abs(error))),
        bias=float(np.mean(error)),
        rows=error.size,
    )


def lag(prediction: Prediction) -> float | None:
    """Return how much later a prediction is than the measurement [s].

    The shift with the greatest correlation, between rows by a parabola; negative where the
    prediction runs ahead. None where one of the two hardly moves, or where no shift within a
    second fits best: then the signals differ in shape, not in time.
    """
    time = prediction.time
    step = float(np.median(np.diff(time))) if time.size > 1 else 0.0
    reach = round(LONGEST_LAG / step) if step > 0.0 else 0
    grid = np.arange(time[0], time[-1], step) if reach else time
    if grid.size < 4 * reach or not reach:
        return None
    measured = np.interp(grid, time, prediction.measured)
    predicted = np.interp(grid, time, prediction.predicted)
    if min(np.std(measured), np.std(predicted)) < LEAST_MOTION:
        return None
    fits = np.array([correlation(measured, predicted, k) for k in range(-reach, reach + 1)])
    best = int(np.argmax(fits))
    if best in (0, fits.size - 1):
        return None
    return step * (best - reach + peak_offset(fits, best))


def correlation(measured: Array, predicted: Array, shift: int) -> float:
    """Return the correlation with a prediction that is ``shift`` rows late."""
    if shift > 0:
        measured, predicted = measured[:-shift], predicted[shift:]
    elif shift < 0:
        measured, predicted = measured[-shift:], predicted[:shift]
    measured, predicted = measured - measured.mean(), predicted - predicted.mean()
    size = float(np.sqrt((measured @ measured) * (predicted @ predicted)))
    return float(measured @ predicted) / max(size, 1.0e-12)


def peak_offset(values: Array, place: int) -> float:
    """Return where a parabola through three neighbours peaks, from the middle one, in rows."""
    before, at, after = values[place - 1 : place + 2]
    bend = before - 2.0 * at + after
    return 0.0 if bend >= 0.0 else float(0.5 * (before - after) / bend)
