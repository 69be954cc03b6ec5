"""What a run is expected to tell of the causes that are open, and of a model's numbers."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tendon_newton.data.recording import Array, Recording
from tendon_newton.diagnosis.explanation import OpenClass, Setting
from tendon_newton.diagnosis.imitation import ImitationTrial
from tendon_newton.diagnosis.next_experiment.separation import (
    Plan,
    Played,
    Prediction,
    plan_run,
    play,
    predict,
)
from tendon_newton.diagnosis.posterior import FittedSet
from tendon_newton.diagnosis.search.floors import form_scales
from tendon_newton.identification.study import Residual

RIVAL_WORTH = 100.0
"""Bits that a pair of causes told apart is worth: classes come before widths of intervals."""


@dataclass(frozen=True, kw_only=True)
class Expected:
    """What a run is expected to bring."""

    prediction: Prediction
    """How far it keeps the causes of the class apart."""
    numbers: Mapping[str, float]
    """Information about each number of the model, as ``owner.name`` [bit]: log2 of what its
    interval shrinks by."""
    peak_force: float | None
    """Largest tension under any model tried [N]; None without a load cell."""

    @property
    def bits(self) -> float:
        """Information about all numbers [bit]."""
        return sum(self.numbers.values())

    @property
    def settles(self) -> float:
        """Pairs of causes that it tells apart; a run of several that it takes counts its share."""
        return sum(1.0 / c.repeats for c in self.prediction.contrasts if c.repeats is not None)

    @property
    def worth(self) -> float:
        """What runs are compared by [bit]."""
        return RIVAL_WORTH * self.settles + self.bits


def expect(
    question: OpenClass, plans: Sequence[Plan], posterior: Information
) -> tuple[Expected, ...]:
    """Return what runs are expected to bring, best first.

    Args:
        question: Explanations of the data.
        plans: The runs.
        posterior: What the data at hand tell already.
    """
    if not plans:
        return ()
    played = play(question, plans)
    return ranked(
        Expected(
            prediction=prediction,
            numbers=posterior.bits(information(question, played, i)),
            peak_force=peak(played.residuals[i]),
        )
        for i, prediction in enumerate(predict(question, played))
    )


def information_of(
    question: OpenClass, known: Sequence[Plan], row_worth: float | None = None
) -> Information:
    """Return what runs at hand leave open of the numbers of the first explanation.

    Args:
        question: Explanations of the data.
        known: Runs of the data.
        row_worth: As of `design`.
    """
    played = play(question, known or [plan_run(question.settings[0], "stairs", 0, 1.0)])
    shown = [information(question, played, i) for i in range(len(known))]
    trial = played.trials[0]
    return Information(trial, sum(shown, np.zeros((len(trial.steps),) * 2)), row_worth)


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


def ranked(found: Iterable[Expected]) -> tuple[Expected, ...]:
    """Return runs, those that bring the most first."""
    return tuple(sorted(found, key=lambda expected: -expected.worth))


def information(question: OpenClass, played: Played, index: int) -> Array:
    """Return what a run says of the numbers of the first explanation, shape (F, F).

    Residuals count in units of what noise and errors of form leave, as in a fit.
    """
    form, noise = form_scales(question.scale), question.noise
    residual, trial = played.residuals[index], played.trials[0]
    own = slice(1, 1 + len(trial.models))
    parts = [residual.theta[own] / max(form.theta, noise.theta)]
    if residual.force is not None and noise.force is not None:
        parts.append(residual.force[own] / max(form.force, noise.force))
    signals = np.concatenate(parts, axis=1)
    jacobian = (signals[1:] - signals[0]).T / trial.steps
    return jacobian.T @ jacobian


class Information:
    """What the data at hand leave open of a model's numbers, and what a run would leave.

    Rows are no independent witnesses: errors of form last. So the information of all rows is scaled
    until it agrees with the intervals of the diagnosis, and that of a new run likewise.

    Args:
        trial: The numbers, their spreads and ranges.
        recorded: Information of the data at hand, shape (F, F).
        row_worth: Independent witnesses per row in place of that [1].
    """

    def __init__(
        self, trial: ImitationTrial, recorded: Array, row_worth: float | None = None
    ) -> None:
        self._prior = np.diag((trial.upper - trial.lower) ** -2.0)
        self._recorded, self._trial, self._spreads = recorded, trial, trial.spreads
        if row_worth is None:
            spread = np.sqrt(np.diag(np.linalg.inv(recorded + self._prior)))
            row_worth = float(np.exp(2.0 * np.mean(np.log(spread / trial.spreads))))
        self._row_worth = row_worth

    def spreads(self, new: Array | float) -> Array:
        """Return standard deviations with further information, shape (F,)."""
        total = self._row_worth * (self._recorded + new) + self._prior
        return np.sqrt(np.diag(np.linalg.inv(total)))

    def left(self) -> FittedSet:
        """Return the numbers and their covariance that the data at hand leave.

        Numbers that the data tie together move together. None is more certain than its interval
        says.
        """
        covariance = np.linalg.inv(self._row_worth * self._recorded + self._prior)
        wider = np.maximum(1.0, self._spreads / np.sqrt(np.diag(covariance)))
        return FittedSet(
            weight=1.0,
            causes=(),
            numbers=self._trial.numbers,
            covariance=np.outer(wider, wider) * 0.5 * (covariance + covariance.T),
        )

    def bits(self, new: Array) -> dict[str, float]:
        """Return by how much each number is known better with a run [bit]."""
        shrinks = np.log2(self.spreads(0.0) / self.spreads(new))
        return dict(zip(self._trial.names, shrinks.tolist(), strict=True))


def peak(residual: Residual) -> float | None:
    """Return the largest tension of a run under all models [N]."""
    return None if residual.force is None else float(np.max(-residual.force))
