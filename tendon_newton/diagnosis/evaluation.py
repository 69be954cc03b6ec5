"""Held-out closed-loop errors of models, and how sure we are of the gain."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tendon_newton.data.recording import Array
from tendon_newton.diagnosis.findings import Findings
from tendon_newton.diagnosis.result import Errors
from tendon_newton.identification.noise_floor import NoiseFloor, share_gone
from tendon_newton.identification.objective import BLOCK, group_sums
from tendon_newton.identification.study import Residual, Study, replacements

RESAMPLES = 2000  # Bootstrap draws of blocks of time
HALVED = 0.75  # Share of the squared error that is gone where an error is half as large [1]
WORTH_A_FRACTION = 1.2
"""A signal whose error is below so many noise floors has no gap to explain a fraction of."""


@dataclass(frozen=True, kw_only=True)
class SquaredErrors:
    """Squared errors summed over blocks of time, shape (B,) each."""

    signals: Mapping[str, tuple[Array, Array]]
    """Name -> squared errors [its unit squared], and how many numbers they are of."""
    theta_abs: Array  # Absolute errors of the motor angle [rad]

    def pooled(self, weights: Array | None = None) -> Errors:
        """Return errors pooled over all rows, blocks counted with some weights."""
        w = np.ones(len(self.theta_abs)) if weights is None else weights
        found = {name: float(np.sqrt(w @ square / rows)) if (rows := float(w @ counted)) else None
                 for name, (square, counted) in self.signals.items()}  # fmt: skip
        theta, force = found.pop("theta"), found.pop("force", None)
        return Errors(
            force_rmse=force,
            theta_rmse=theta or 0.0,
            theta_mae=float(w @ self.theta_abs / (w @ self.signals["theta"][1])),
            others_rmse={name: size for name, size in found.items() if size is not None},
        )


def evaluate_models(study: Study, models: Sequence[Mapping[int, float]]) -> list[SquaredErrors]:
    """Simulate held-out recordings with some models, each given as parameter column -> value.

    Rows that no model can know, such as those after a gap in which the command jumped, are left
    out as they are of fits.
    """
    residuals = study.residuals(*replacements(models))
    there = tuple(dict.fromkeys(name for residual in residuals for name in residual.signals))
    return [squared_errors(study, residuals, n, there) for n in range(len(models))]


def squared_errors(
    study: Study, residuals: Sequence[Residual], n: int, there: Sequence[str]
) -> SquaredErrors:
    """Return the squared errors of the model of a number, of the signals that are there."""
    squares: dict[str, list[Array]] = {name: [] for name in there}
    counts: dict[str, list[Array]] = {name: [] for name in there}
    absolute: list[Array] = []
    for recording, residual in zip(study.recordings, residuals, strict=True):
        kept = residual.trusted
        whole = ((recording.time - recording.time[0]) / BLOCK).astype(int)
        block, count = whole[kept], int(whole[-1]) + 1
        rows = np.bincount(block, minlength=count).astype(np.float64)
        absolute.append(group_sums(np.abs(residual.theta[n, kept]), block, count))
        for name in there:
            own = residual.signals[name][n][:, kept] if name in residual.signals else ()
            squares[name].append(sum((group_sums(c**2, block, count) for c in own), 0.0 * rows))
            counts[name].append(len(own) * rows)
    signals = {name: (np.concatenate(squares[name]), np.concatenate(counts[name]))
               for name in there}  # fmt: skip
    return SquaredErrors(signals=signals, theta_abs=np.concatenate(absolute))


def explained_fraction(before: Errors, after: Errors, noise: NoiseFloor) -> float:
    """Return the share of the squared error above the noise that is gone, see `share_gone` [1]."""
    signals = list[tuple[float, float, float]]()
    for name in ("theta", "force", *before.others_rmse):
        top, left, floor = before.of(name), after.of(name), noise.of(name)
        if top is not None and left is not None and floor and top > WORTH_A_FRACTION * floor:
            signals.append((top, left, floor))
    return share_gone(signals) or 0.0


def fraction_interval(
    before: SquaredErrors, after: SquaredErrors, noise: NoiseFloor, rng: np.random.Generator
) -> tuple[float, float]:
    """Return the 95 % block-bootstrap interval of `explained_fraction`."""
    count = len(before.theta_abs)
    draws = [
        explained_fraction(before.pooled(weights), after.pooled(weights), noise)
        for weights in rng.multinomial(count, np.full(count, 1.0 / count), RESAMPLES).astype(float)
    ]
    low, high = np.quantile(draws, (0.025, 0.975))
    return float(low), float(high)


def with_whole_recordings(findings: Findings, whole: Study, rng: np.random.Generator) -> Findings:
    """Return findings without a predictor that is surely worse than the answer on whole recordings.

    A search simulates pieces of long recordings, which show little of what grows with time.

    Args:
        findings: What was found on pieces.
        whole: The same recordings, uncut.
        rng: Draws the recordings of the interval of what the predictor explains of the rest.
    """
    if findings.predictor is None:
        return findings
    answer = findings.final or findings.baseline
    before, after = evaluate_models(whole, [answer.values, findings.predictor.values])
    _, highest = fraction_interval(before, after, whole.noise, rng)
    return replace(findings, predictor=None) if highest < 0.0 else findings


def is_in_doubt(
    before: SquaredErrors,
    after: SquaredErrors,
    without: Sequence[SquaredErrors],
    plain: Sequence[SquaredErrors],
    noise: NoiseFloor,
    highest: float,
) -> bool:
    """Tell whether held-out recordings contradict that an answer explains them.

    They do where it explains more without one of its causes, beyond the interval of what it
    explains, and where a plain model halves what it leaves.

    Args:
        before: Errors of the starting model.
        after: Errors of the answer.
        without: Errors of the answer without each named cause.
        plain: Errors of plain models.
        noise: Noise of the signals.
        highest: Upper end of the interval of the share that is explained [1].
    """
    fewer = (explained_fraction(before.pooled(), own.pooled(), noise) for own in without)
    plainer = (explained_fraction(after.pooled(), own.pooled(), noise) for own in plain)
    return any(share > highest for share in fewer) or any(share > HALVED for share in plainer)
