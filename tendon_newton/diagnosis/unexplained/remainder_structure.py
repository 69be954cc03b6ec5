"""Does structure remain? A flexible learner against noise of the same colour, and on what."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tendon_newton.data.parameters import BenchScale
from tendon_newton.data.recording import Array, Indices
from tendon_newton.diagnosis.unexplained.learner import RIDGES, Basis, Learner, held_out_r2
from tendon_newton.diagnosis.unexplained.remainder import (
    Remainder,
    Side,
    find_remainders,
    side_words,
)
from tendon_newton.identification.study import Study

SURROGATES = 60  # Noise records; the least p-value is one in so many
MOST_ROWS = 3000  # Rows that are learned from, evenly thinned
P_VALUE = 0.02  # Chance of finding structure in noise
LEAST_R2 = 0.1
"""Held-out share of the remaining variance below which structure is not worth a word.

Dry friction leaves some beside a model that is otherwise right, as its law is not exact: 0.02 on
planted servos.
"""
BEARS = 0.2
"""A signal whose loss costs less than this share of the best one's is not said to matter."""
MOST_SIGNALS = 4  # Signals that are named at most
MOST_PROFILES = 2  # Signals that are drawn
BINS = 40  # Bins of a signal in a picture
LEAST_ROWS = 8  # Rows that a bin must hold to be drawn
SPLITS = 5  # Folds at most, and spans of time where there is but one recording
SEED = 0


@dataclass(frozen=True, kw_only=True)
class Profile:
    """How the remainder, and what was learned of it, goes with one signal, by bins."""

    signal: str
    center: Array  # Mean of the signal in each bin, shape (N,)
    mean: Array  # Mean remainder [N or rad]
    error: Array  # Half of its 95 % interval, from the scatter between stretches of time
    learned: Array  # Mean of what the learner says of rows that it has not seen


@dataclass(frozen=True, kw_only=True)
class RemainderStructure:
    """Structure that a flexible learner finds in the remainder."""

    side: Side  # Side of the load cell on which the structure sits
    found: bool  # Whether more than noise is there
    held_out_r2: float  # Share of the variance predicted on recordings that the learner did not see
    p_value: float  # Chance of that with noise of the remainder's own colour
    size: float  # Root mean square of the remainder [N or rad]
    importance: Mapping[str, float]
    """Share of the variance that is lost when one signal is shuffled, greatest first."""
    profiles: tuple[Profile, ...] = ()
    scale: BenchScale = field(default_factory=BenchScale)  # Scale of the benches

    @property
    def depends_on(self) -> tuple[str, ...]:
        """Signals that matter, the strongest first."""
        return named_signals(self.importance)

    def to_json(self) -> dict[str, Any]:
        """Return it for ``diagnosis.json``."""
        return {
            "found": self.found,
            "side": self.side,
            "held_out_r2": round(self.held_out_r2, 4),
            "p_value": self.p_value,
            "size": self.size,
            "unit": side_words(self.side, self.scale)[1],
            "importance": {name: round(lost, 4) for name, lost in self.importance.items()},
        }


def find_structure(study: Study, values: Mapping[int, float]) -> RemainderStructure:
    """Look for structure in what a model leaves, on the side where there is most of it.

    Args:
        study: Recordings, held out in turn.
        values: The model's parameters, column -> value.
    """
    looked = [look(thinned(remainder)) for remainder in find_remainders(study, values)]
    return max(looked, key=lambda s: (s.found, s.held_out_r2))


def named_signals(importance: Mapping[str, float]) -> tuple[str, ...]:
    """Return the signals that matter beside the strongest one, which comes first."""
    most = max(importance.values(), default=0.0)
    return tuple(name for name, lost in importance.items() if lost > BEARS * most)[:MOST_SIGNALS]


def thinned(remainder: Remainder) -> Remainder:
    """Keep every n-th row, so that there are not too many."""
    keep = slice(None, None, int(np.ceil(len(remainder.residual) / MOST_ROWS)))
    return Remainder(
        side=remainder.side,
        residual=remainder.residual[keep],
        signals={name: x[keep] for name, x in remainder.signals.items()},
        recording=remainder.recording[keep],
        scale=remainder.scale,
    )


def look(remainder: Remainder) -> RemainderStructure:
    """Learn one side's remainder and compare with noise of the same colour."""
    rng = np.random.default_rng(SEED)
    folds = make_folds(remainder.recording)
    basis = Basis(remainder.signals, rng)
    features = basis.features(remainder.signals)
    noise = phase_randomised(remainder.residual, remainder.recording, rng)
    targets = np.concatenate([remainder.residual[:, None], noise], axis=1)
    shares = held_out_r2(features, targets, folds)
    best = RIDGES[int(np.argmax(shares[:, 0]))]
    reached = shares.max(axis=0)
    r2 = float(reached[0])
    p_value = float((1 + np.sum(reached[1:] >= r2)) / (1 + SURROGATES))
    found = p_value <= P_VALUE and r2 >= LEAST_R2
    importance, profiles = {}, ()
    if found:
        learner = Learner(remainder, basis, folds, best)
        importance = learner.importance(rng)
        signals = named_signals(importance)
        profiles = tuple(profile_of(learner, name) for name in signals[:MOST_PROFILES])
    return RemainderStructure(
        side=remainder.side,
        found=found,
        held_out_r2=r2,
        p_value=p_value,
        size=remainder.size,
        importance=importance,
        profiles=profiles,
        scale=remainder.scale,
    )


def profile_of(learner: Learner, name: str) -> Profile:
    """Average remainder and prediction in bins of one signal, nearly empty ones left out."""
    x, y = learner.remainder.signals[name], learner.remainder.residual
    low, high = np.quantile(x, (0.005, 0.995))
    place = np.clip((x - low) / max(high - low, 1.0e-12) * BINS, 0.0, BINS - 1).astype(np.intp)
    bins = [np.flatnonzero(place == k) for k in range(BINS)]
    filled = [rows for rows in bins if len(rows) >= LEAST_ROWS]
    return Profile(
        signal=name,
        center=np.array([x[rows].mean() for rows in filled]),
        mean=np.array([y[rows].mean() for rows in filled]),
        error=np.array([mean_error(y, rows) for rows in filled]),
        learned=np.array([learner.learned[rows].mean() for rows in filled]),
    )


def mean_error(y: Array, rows: Indices) -> float:
    """Return half the 95 % interval of a mean over rows; neighbours in time count as one visit."""
    visits = np.split(y[rows], np.flatnonzero(np.diff(rows) > 1) + 1)
    sums = np.array([visit.sum() - len(visit) * y[rows].mean() for visit in visits])
    scatter = np.sqrt(np.sum(sums**2) * len(visits) / max(1, len(visits) - 1)) / len(rows)
    return float(1.96 * scatter) if len(visits) > 1 else float(np.std(y[rows]))


def make_folds(recording: Indices) -> Indices:
    """Hold out recording by recording; where there is but one, span by span."""
    names = np.unique(recording)
    if len(names) > 1:
        return np.searchsorted(names, recording) % SPLITS
    return np.arange(len(recording)) * SPLITS // len(recording)


def phase_randomised(residual: Array, recording: Indices, rng: np.random.Generator) -> Array:
    """Return noise with each recording's own spectrum, shape (M, SURROGATES)."""
    out = np.zeros((len(residual), SURROGATES))
    for index in np.unique(recording):
        rows = np.flatnonzero(recording == index)
        spectrum = np.abs(np.fft.rfft(residual[rows]))[:, None]
        phase = rng.uniform(0.0, 2.0 * np.pi, (len(spectrum), SURROGATES))
        out[rows] = np.fft.irfft(spectrum * np.exp(1j * phase), n=len(rows), axis=0)
    return out
