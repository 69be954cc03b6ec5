"""What one cause cannot imitate of another on a run, however it is refitted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise

import numpy as np

from tendon_newton.data.recording import Array
from tendon_newton.data.root_mean_square import rms
from tendon_newton.diagnosis.explanation import Explanation
from tendon_newton.diagnosis.posterior import Coordinate, OpenNumber
from tendon_newton.identification.noise_floor import NoiseFloor
from tendon_newton.identification.objective import Scales, loss_terms
from tendon_newton.identification.study import Residual, Study

STEP_SHARE = 1.0e-2
"""Finite-difference step as a share of a number's value [1]; stick and slip make smaller steps
noisy."""
STEP_FLOOR = 1.0e-4
"""Further step as a share of the number's range [1]."""


@dataclass(frozen=True, kw_only=True)
class Likeness:
    """What one cause cannot imitate of another on a run."""

    pair: tuple[str, str]
    """Imitated and imitating cause."""
    theta: float
    """RMS difference of the motor angle that is left [rad]."""
    force: float | None
    """RMS difference of the tension that is left [N]; None without a load cell."""
    separation: float
    """Both together, RMS in noise floors [1]."""

    behind: float
    """Loss by which the imitation is worse."""
    scatter: float
    """Standard deviation of that under the sensors' noise."""
    gain: float
    """Loss that the imitated cause removes."""


class ImitationTrial:
    """One explanation as models to simulate: itself, and each of its numbers moved a little.

    Args:
        study: The planned runs.
        explanation: The cause and the numbers of its fit.
    """

    def __init__(self, study: Study, explanation: Explanation) -> None:
        self.cause = explanation.cause
        values, steps, spreads, lower, upper = {}, [], [], [], []
        numbers = list[OpenNumber]()
        # A bench's own fitted numbers are in the model already; other benches have their own.
        shared = [owner for owner in explanation.numbers if study.table.columns(owner)]
        for owner in shared:
            for name, estimate in explanation.numbers[owner].items():
                column = study.table.column(owner, name)
                parameter = study.parameter(column)
                value = float(np.clip(estimate.value, parameter.lower, parameter.upper))
                step = STEP_SHARE * abs(value) + STEP_FLOOR * (parameter.upper - parameter.lower)
                values[column] = value
                scale = Coordinate(
                    kind="linear",
                    origin=0.0,
                    unit=1.0,
                    lower=parameter.lower,
                    upper=parameter.upper,
                )
                numbers.append(OpenNumber(owner=owner, name=name, coordinate=scale, place=value))
                steps.append(step if value + step <= parameter.upper else -step)
                spreads.append(max((estimate.ci95[1] - estimate.ci95[0]) / 4.0, abs(step) * 1e-3))
                lower.append(parameter.lower - value)
                upper.append(parameter.upper - value)
        self.numbers = tuple(numbers)
        self.names = tuple(f"{number.owner}.{number.name}" for number in numbers)
        self.steps, self.spreads = np.array(steps), np.array(spreads)
        self.lower, self.upper = np.array(lower), np.array(upper)
        moved = [{**values, c: values[c] + s} for c, s in zip(values, steps, strict=True)]
        self.models = [values, *moved]

    def refit(self, miss: Array, jacobian: Array) -> Array:
        """Return what this explanation cannot imitate of a difference.

        Args:
            miss: What another one would measure less what this one predicts, shape (M,).
            jacobian: Change of the prediction per number, shape (M, F).

        Both are in units of what a fit may leave. The data at hand hold each number within its
        interval.
        """
        prior = np.diag(1.0 / self.spreads**2)
        step = np.linalg.solve(jacobian.T @ jacobian + prior, jacobian.T @ miss)
        return miss - jacobian @ np.clip(step, self.lower, self.upper)


def find_likenesses(
    residual: Residual, trials: Sequence[ImitationTrial], noise: NoiseFloor, form: Scales
) -> tuple[Likeness, ...]:
    """Return for each two causes how well the better imitator of them imitates, on one run.

    Args:
        residual: Of a recording of zeros, for the model without a cause and then for each trial's
            models.
        trials: The causes.
        noise: Of the sensors.
        form: By how much simple laws miss.
    """
    rows = residual.theta.shape[1]
    signals, floor, left = -residual.theta, [noise.theta], [max(form.theta, noise.theta)]
    if residual.force is not None and noise.force is not None:
        signals = np.concatenate([signals, -residual.force], axis=1)
        floor.append(noise.force)
        left.append(max(form.force, noise.force))
    unit = np.repeat(left, rows)
    scaled, quiet = signals / unit, np.repeat(floor, rows) / unit
    starts = np.cumsum([1, *(len(trial.models) for trial in trials)])
    spans = [scaled[i:j] for i, j in pairwise(starts)]
    found = []
    for a, b in combinations(range(len(trials)), 2):
        ways = [
            imitate(trials[j], spans[j], spans[i][0], (trials[i].cause, trials[j].cause))
            for i, j in ((a, b), (b, a))
        ]
        pair, miss, own = min(ways, key=lambda way: float(loss_terms(way[1]).sum()))
        away = (miss * unit).reshape(-1, rows)
        found.append(
            Likeness(
                pair=pair,
                theta=rms(away[0]),
                force=rms(away[1]) if len(away) > 1 else None,
                separation=float(np.linalg.norm(miss / quiet) / np.sqrt(rows)),
                behind=float(loss_terms(miss).sum()),
                scatter=float(np.sqrt(np.sum((miss * quiet) ** 2))),
                gain=float(loss_terms(own - scaled[0]).sum()),
            )
        )
    return tuple(found)


def imitate(
    imitator: ImitationTrial, models: Array, imitated: Array, pair: tuple[str, str]
) -> tuple[tuple[str, str], Array, Array]:
    """Return the pair, what the imitator cannot imitate, and the signals that it should."""
    jacobian = (models[1:] - models[0]).T / imitator.steps
    return pair, imitator.refit(imitated - models[0], jacobian), imitated
