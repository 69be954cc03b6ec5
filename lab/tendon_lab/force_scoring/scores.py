"""Errors of a prediction against a measurement."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

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
