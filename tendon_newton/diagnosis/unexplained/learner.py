"""A flexible learner: ridge regression on cosines of signals, judged on what it has not seen."""

from collections.abc import Mapping, Sequence

import numpy as np

from tendon_newton.data.recording import Array, Indices
from tendon_newton.diagnosis.unexplained.remainder import Remainder

HARMONICS = 24  # Cosines per signal
FINE = {"theta": 128, "theta_d": 128}
"""Cosines of angles: teeth, magnets and counts repeat many times over the range."""
MIXED = 100  # Cosines of random directions, for what several signals decide together
STEEPNESS = (2.0, 5.0)  # Typical phase of these across a signal's range [rad]
RIDGES = (1.0e-4, 1.0e-3, 1.0e-2, 1.0e-1)
"""Ridge factors [1]; the best one counts, for noise as for the residual."""


class Basis:
    """Cosines of each signal alone, and of random mixtures.

    Args:
        signals: Values of each signal, for its range.
        rng: Draws the mixtures.
    """

    def __init__(self, signals: Mapping[str, Array], rng: np.random.Generator) -> None:
        self.ends = {n: np.quantile(x, (0.001, 0.999)) for n, x in signals.items()}
        steepness = rng.choice(STEEPNESS, MIXED)
        self.directions = rng.normal(0.0, 1.0, (len(signals), MIXED)) * steepness
        self.phases = rng.uniform(0.0, 2.0 * np.pi, MIXED)

    def features(self, signals: Mapping[str, Array]) -> Array:
        """Return all functions at the rows of some signals, shape (M, P)."""
        columns: list[Array] = []
        places: list[Array] = []
        for name, (low, high) in self.ends.items():
            place = np.clip((signals[name] - low) / max(high - low, 1.0e-12), 0.0, 1.0)
            order = np.arange(1, FINE.get(name, HARMONICS) + 1)
            # coarse before fine: a ridge on these weights prefers smooth functions
            columns.append(np.cos(np.pi * place[:, None] * order) / np.sqrt(order))
            places.append(place - 0.5)
        mixed = np.stack(places, axis=1) @ self.directions + self.phases
        return np.concatenate([*columns, 0.3 * np.cos(mixed)], axis=1)


class Learner:
    """Ridge regressions that each have not seen one fold.

    Args:
        folds: Fold of each row.
        ridge: Ridge factor [1].
    """

    def __init__(self, remainder: Remainder, basis: Basis, folds: Indices, ridge: float) -> None:
        self.remainder, self.basis, self.folds = remainder, basis, folds
        features = basis.features(remainder.signals)
        self.fits = {
            int(fold): fit_ridges(
                features[folds != fold], remainder.residual[folds != fold, None], (ridge,)
            )[0]
            for fold in np.unique(folds)
        }
        self.learned = self.predict(remainder.signals)

    def predict(self, signals: Mapping[str, Array]) -> Array:
        """Return what each row's fold is predicted to be by the fit that did not see it."""
        features = self.basis.features(signals)
        out = np.zeros(len(self.folds))
        for fold, (weights, offset) in self.fits.items():
            rows = self.folds == fold
            out[rows] = (features[rows] @ weights + offset)[:, 0]
        return out

    def importance(self, rng: np.random.Generator) -> dict[str, float]:
        """Return the share of the variance lost when one signal is shuffled within each fold."""
        y = self.remainder.residual
        total = float(np.sum((y - y.mean()) ** 2))
        missed = float(np.sum((y - self.learned) ** 2))
        lost: dict[str, float] = {}
        for name, x in self.remainder.signals.items():
            shuffled = x.copy()
            for fold in self.fits:
                rows = np.flatnonzero(self.folds == fold)
                shuffled[rows] = x[rng.permutation(rows)]
            again = self.predict({**self.remainder.signals, name: shuffled})
            worse = float(np.sum((y - again) ** 2)) - missed
            lost[name] = float(np.clip(worse / total, 0.0, 1.0))
        return dict(sorted(lost.items(), key=lambda item: -item[1]))


def fit_ridges(
    features: Array, targets: Array, ridges: Sequence[float]
) -> list[tuple[Array, Array]]:
    """Return weights (P, N) and offsets (N,) of regressions on N targets, for each ridge factor."""
    center, offset = features.mean(axis=0), targets.mean(axis=0)
    moved = features - center
    gram, across = moved.T @ moved, moved.T @ (targets - offset)
    fits: list[tuple[Array, Array]] = []
    for ridge in ridges:
        held: Array = gram + ridge * len(features) * np.eye(len(gram))
        weights = np.asarray(np.linalg.solve(held, across), dtype=np.float64)
        fits.append((weights, offset - center @ weights))
    return fits


def held_out_r2(features: Array, targets: Array, folds: Indices) -> Array:
    """Return the share of each target's variance that is predicted on unseen folds.

    Shape (ridge factors, N).
    """
    missed = np.zeros((len(RIDGES), targets.shape[1]))
    for fold in np.unique(folds):
        out = folds == fold
        fits = fit_ridges(features[~out], targets[~out], RIDGES)
        for k, (weights, offset) in enumerate(fits):
            missed[k] += np.sum((targets[out] - features[out] @ weights - offset) ** 2, axis=0)
    return 1.0 - missed / np.maximum(np.sum((targets - targets.mean(axis=0)) ** 2, axis=0), 1e-300)
