"""What a run, or a measurement by hand, is expected to tell: names, predictions, numbers."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from scipy.linalg import block_diag

from tendon_newton.actuators import find_actuator
from tendon_newton.data.excitations import RATE
from tendon_newton.data.recording import Array
from tendon_newton.diagnosis.next_experiment.open_sets import OpenSets, PlayedSets, moved_sets, play
from tendon_newton.diagnosis.next_experiment.planned_runs import Plan
from tendon_newton.diagnosis.search.search_worlds import INDEPENDENT
from tendon_newton.errors import InvalidParameter
from tendon_newton.identification.intervals import SHARED_FORM

QUIET = 0.1  # Spread of a prediction that matters to nobody [errors of form]
SETS_WORTH = INDEPENDENT / RATE / SHARED_FORM**2
"""Independent witnesses per row, as a diagnosis weighs sets [1]: errors of form last over rows."""


@dataclass(frozen=True, kw_only=True)
class Told:
    """Information, expected or brought [bit]."""

    names: float  # By which the entropy of the sets of causes falls
    task: float  # log2 of what the spread of predictions of the task shrinks by
    numbers: Mapping[str, float]
    """log2 of what the interval of each number of the likeliest set shrinks by, ``owner.name``."""

    @property
    def worth(self) -> float:
        """What runs are compared by: names, predictions and the mean number count alike [bit]."""
        return self.names + self.task + sum(self.numbers.values()) / max(1, len(self.numbers))


@dataclass(frozen=True, kw_only=True)
class Expected:
    """What a run is expected to bring."""

    plan: Plan
    told: Told
    peak_force: float | None  # Largest tension under any model tried [N]; None without a load cell


class Forecast:
    """What is open now, and what would be left of it.

    Each set is Gaussian in its numbers, and its predictions are linear in them.

    Args:
        question: The sets.
        task: The run that a model shall predict.
        row_worth: Independent witnesses per row [1].
    """

    def __init__(self, question: OpenSets, task: Plan, row_worth: float = SETS_WORTH) -> None:
        if find_actuator(question.model.actuator.name).leads:
            raise InvalidParameter(
                "runs are designed as commands of a servo, and here a shaft is led along a path: "
                "lead it more slowly and under other loads, and diagnose that with the recordings "
                "at hand"
            )
        self.question, self.weights = question, question.weights
        study = question.study([task])
        self.sets = moved_sets(question, study)
        (self._task,) = play(question, [task])
        self._worth = row_worth
        self._covariances = [own.covariance for own in self.sets]

    @property
    def entropy(self) -> float:
        """Entropy of the sets of causes [bit]."""
        return -float(self.weights @ np.log2(self.weights))

    def runs(self, plans: Sequence[Plan]) -> tuple[Expected, ...]:
        """Return what runs are expected to bring, best first."""
        return ranked(
            Expected(plan=plan, told=self.told(played, self._worth), peak_force=played.peak_force)
            for plan, played in zip(plans, play(self.question, plans), strict=True)
        )

    def told(self, played: PlayedSets, worth: float) -> Told:
        """Return what is expected of a run.

        Args:
            played: The run under all sets.
            worth: Independent witnesses per row [1].
        """
        after = self._after(played, worth)
        overlap = np.exp(-self._apart(played, worth))
        likely = self.weights * overlap
        likely /= likely.sum(axis=1, keepdims=True)
        before = self._variance(self.weights, self._covariances)
        left = self.weights @ np.array([self._variance(own, after) for own in likely])
        first = shrinks(self._covariances[0].diagonal(), after[0].diagonal()).tolist()
        return Told(
            names=-float(self.weights @ np.log2(overlap @ self.weights)),
            task=0.5 * float(np.log2(before / left)),
            numbers={
                name: 0.5 * float(np.log2(shrinks))
                for name, shrinks in zip(self.sets[0].names, first, strict=True)
            },
        )

    def _after(self, played: PlayedSets, worth: float) -> list[Array]:
        """Return each set's covariance once a run is seen, shape (F, F)."""
        return [informed(c, worth * played.slopes[k][k]) for k, c in enumerate(self._covariances)]

    def _apart(self, played: PlayedSets, worth: float) -> Array:
        """Return how far apart a run keeps two sets, however their numbers are, shape (K, K).

        The distance is Bhattacharyya's between what they predict, two Gaussians that differ in
        mean and covariance. With it the entropy of a mixture is bounded, and so the information
        about which set is true, from below.

        Source: Kolchinsky and Tracey, Estimating Mixture Entropy with Pairwise Distances (2017).
        """
        count, now = len(self.weights), self._covariances
        apart = np.zeros((count, count))
        sizes = [log_size(c, worth * played.slopes[k][k]) for k, c in enumerate(now)]
        for a, b in combinations(range(count), 2):
            both = 0.5 * np.asarray(block_diag(now[a], now[b]), dtype=np.float64)
            told = worth * np.block([[played.slopes[i][j] for j in (a, b)] for i in (a, b)])
            seen = [played.mixed[k][:, a] - played.mixed[k][:, b] for k in (a, b)]
            miss = worth * np.concatenate(seen)
            away = played.means[a, a] + played.means[b, b] - 2.0 * played.means[a, b]
            square = worth * away - miss @ informed(both, told) @ miss
            wider = log_size(both, told) - 0.5 * (sizes[a] + sizes[b])
            apart[a, b] = apart[b, a] = max(0.0, square / 8.0 + wider / 2.0)
        return apart

    def _variance(self, weights: Array, covariances: Sequence[Array]) -> float:
        """Return the mean variance of the predictions of the task [squared errors of form]."""
        task = self._task
        within = [np.trace(c @ task.slopes[k][k]) for k, c in enumerate(covariances)]
        apart = weights @ task.means.diagonal() - weights @ task.means @ weights
        return QUIET**2 + float(weights @ within + apart) / task.rows


def informed(covariance: Array, information: Array) -> Array:
    """Return a covariance once further information is there, shape (F, F)."""
    left = np.linalg.solve(np.eye(len(covariance)) + covariance @ information, covariance)
    return 0.5 * (left + left.T)


def log_size(covariance: Array, information: Array) -> float:
    """Return the logarithm of how much smaller information makes a covariance [nat]."""
    return float(np.linalg.slogdet(np.eye(len(covariance)) + covariance @ information)[1])


def ranked(found: Iterable[Expected]) -> tuple[Expected, ...]:
    """Return runs, those that bring the most first."""
    return tuple(sorted(found, key=lambda expected: -expected.told.worth))


def shrinks(before: Array, after: Array) -> Array:
    """Return how many times smaller variances become [1]; what is certain already stays so."""
    return np.divide(before, after, out=np.ones_like(before), where=after > 0.0)
