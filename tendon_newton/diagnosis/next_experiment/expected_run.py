"""What a run, or a measurement by hand, is expected to tell: names, the user's task, numbers."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tendon_newton.data.excitations import RATE
from tendon_newton.data.recording import Array, Recording
from tendon_newton.diagnosis.explanation import Setting
from tendon_newton.diagnosis.next_experiment.open_sets import (
    OpenSets,
    Played,
    moved_sets,
    play,
)
from tendon_newton.diagnosis.next_experiment.separation import Plan
from tendon_newton.diagnosis.search.search_worlds import INDEPENDENT
from tendon_newton.identification.intervals import WIDENING

QUIET = 0.1
"""Spread of a prediction that matters to nobody [errors of form]."""
SHARE = 0.25
"""Share of the evidence between two sets that is counted on [1]; see `Forecast`."""
SETS_WORTH = INDEPENDENT / RATE / WIDENING**2
"""Independent witnesses per row of evidence between sets, as a diagnosis weighs them [1]."""
WORTHS, HALVINGS = (1.0e-6, 1.0), 30
"""Least and greatest worth of a row [independent witnesses], and steps to find it between them."""


@dataclass(frozen=True, kw_only=True)
class Told:
    """Information, expected or brought [bit]."""

    names: float
    """By which the entropy of the sets of causes falls."""
    task: float
    """log2 of what the spread of predictions of the task shrinks by."""
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
    peak_force: float | None
    """Largest tension under any model tried [N]; None without a load cell."""


class Forecast:
    """What is open now, and what would be left of it.

    Each set is Gaussian in its numbers, and its predictions are linear in them. Rows are no
    independent witnesses, since errors of form last: what the runs at hand tell of the numbers is
    scaled until it agrees with the intervals of the diagnosis, and that of a new run likewise.

    Args:
        question: The sets.
        known: Runs at hand: what they tell already is no news.
        task: The run whose prediction matters to the user.
        row_worth: Independent witnesses per row in place of what the runs at hand say [1].
    """

    def __init__(
        self,
        question: OpenSets,
        known: Sequence[Plan],
        task: Plan,
        row_worth: float | None = None,
    ) -> None:
        self.question, self.weights = question, question.weights
        self.sets = moved_sets(question, question.study([task]))
        self._task, *seen = play(question, [task, *known])
        told = [np.sum([p.slopes[k][k] for p in seen], axis=0) for k in range(len(self.sets))]
        self._worth = self._row_worth(told[0]) if row_worth is None else row_worth
        self._covariances = [informed(own.prior, self._worth * rows)
                             for own, rows in zip(self.sets, told, strict=True)]  # fmt: skip

    @property
    def entropy(self) -> float:
        """Entropy of the sets of causes [bit]."""
        return entropy(self.weights)

    @property
    def spread(self) -> float:
        """Spread of the predictions of the task [errors of form]."""
        return float(np.sqrt(self._variance(self.weights, self._covariances)))

    def runs(self, plans: Sequence[Plan]) -> tuple[Expected, ...]:
        """Return what runs are expected to bring, best first."""
        return ranked(
            Expected(plan=plan, told=self.told(played, self._worth), peak_force=played.peak_force)
            for plan, played in zip(plans, play(self.question, plans), strict=True)
        )

    def told(self, played: Played, worth: float) -> Told:
        """Return what is expected of a run.

        Args:
            played: The run under all sets.
            worth: Independent witnesses per row [1].
        """
        after = self._after(played, worth)
        likely = self._likely(played, max(worth, SETS_WORTH))
        before = self._variance(self.weights, self._covariances)
        left = sum(
            w * self._variance(own, after) for w, own in zip(self.weights, likely, strict=True)
        )
        first = zip(
            self.sets[0].names, self._covariances[0].diagonal(), after[0].diagonal(), strict=True
        )
        return Told(
            names=self.entropy
            - sum(w * entropy(p) for w, p in zip(self.weights, likely, strict=True)),
            task=0.5 * float(np.log2(before / left)),
            numbers={name: 0.5 * float(np.log2(old / new)) for name, old, new in first},
        )

    def _after(self, played: Played, worth: float) -> list[Array]:
        """Return each set's covariance once a run is seen, shape (F, F)."""
        return [informed(c, worth * played.slopes[k][k]) for k, c in enumerate(self._covariances)]

    def _likely(self, played: Played, worth: float) -> Array:
        """Return the weights of the sets once a run is seen, for each as the true one, (K, K).

        The evidence for a set is that of its divergence from the true one: Kullback and Leibler's,
        of two Gaussians that differ in mean and covariance. A quarter of it bounds the information
        about the sets from below where covariances are alike.

        Source: Kolchinsky and Tracey, Estimating Mixture Entropy with Pairwise Distances (2017).
        """
        count, after = len(self.weights), self._after(played, worth)
        behind = np.zeros((count, count))
        inside = [c @ (worth * played.slopes[k][k]) for k, c in enumerate(self._covariances)]
        sizes = [np.linalg.slogdet(np.eye(len(c)) + c)[1] for c in inside]
        for a in range(count):
            for b in range(count):
                if a == b:
                    continue
                away = played.means[a, a] + played.means[b, b] - 2.0 * played.means[a, b]
                seen = worth * (played.mixed[b][:, a] - played.mixed[b][:, b])
                cross = worth * played.slopes[b][a]
                behind[a, b] = 0.5 * (
                    np.trace(inside[a])
                    - worth * np.trace(after[b] @ played.slopes[b][b])
                    - np.trace(after[b] @ cross @ self._covariances[a] @ cross.T)
                    + worth * away
                    - seen @ after[b] @ seen
                    + sizes[b]
                    - sizes[a]
                )
        scores = np.log(self.weights) - SHARE * np.maximum(behind, 0.0)
        likely = np.exp(scores - scores.max(axis=1, keepdims=True))
        return likely / likely.sum(axis=1, keepdims=True)

    def _variance(self, weights: Array, covariances: Sequence[Array]) -> float:
        """Return the mean variance of the predictions of the task [squared errors of form]."""
        task = self._task
        within = [np.trace(c @ task.slopes[k][k]) for k, c in enumerate(covariances)]
        apart = weights @ task.means.diagonal() - weights @ task.means @ weights
        return QUIET**2 + float(weights @ within + apart) / task.rows

    def _row_worth(self, told: Array) -> float:
        """Return the witnesses per row with which the runs at hand leave what a diagnosis says.

        Args:
            told: Information of all rows about the numbers of the likeliest set, shape (F, F).
        """
        first, (low, high) = self.sets[0], WORTHS
        for _ in range(HALVINGS):
            middle = float(np.sqrt(low * high))
            left = informed(first.prior, middle * told).diagonal()
            is_wide = np.log(left / first.covariance.diagonal()).sum() > 0.0
            low, high = (middle, high) if is_wide else (low, middle)
        return float(np.sqrt(low * high))


def informed(covariance: Array, information: Array) -> Array:
    """Return a covariance once further information is there, shape (F, F)."""
    left = np.linalg.solve(np.eye(len(covariance)) + covariance @ information, covariance)
    return 0.5 * (left + left.T)


def entropy(weights: Array) -> float:
    """Return the entropy of weights that are one together [bit]."""
    kept = weights[weights > 0.0]
    return float(-kept @ np.log2(kept))


def ranked(found: Iterable[Expected]) -> tuple[Expected, ...]:
    """Return runs, those that bring the most first."""
    return tuple(sorted(found, key=lambda expected: -expected.told.worth))


def plan_of(recording: Recording) -> Plan:
    """Return a recorded run as if it were still to be made."""
    if recording.command is None:
        raise ValueError(f"{recording.name}: a run to be made again has commands")
    return Plan(
        setting=Setting(
            bench=recording.bench,
            bench_overrides=recording.bench_overrides,
            actuator_overrides=dict(recording.actuator_overrides),
        ),
        excitation=recording.name,
        time=recording.time,
        command=recording.command[:, 0],
    )
