"""Held-out closed-loop errors of models, and how sure we are of the gain."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tendon_newton.data.recording import Array
from tendon_newton.diagnosis.findings import Findings
from tendon_newton.diagnosis.result import Errors
from tendon_newton.identification.noise_floor import NoiseFloor
from tendon_newton.identification.objective import BLOCK, group_sums
from tendon_newton.identification.study import Study, replacements

RESAMPLES = 2000  # Bootstrap draws of blocks of time
HARDLY_ANY = 0.02
"""Share of the other signal's gap, both in squares of the noise, below which one is none [1]."""
HALVED = 0.75  # Share of the squared error that is gone where an error is half as large [1]
WORTH_A_FRACTION = 1.2
"""A signal whose error is below so many noise floors has no gap to explain a fraction of."""


@dataclass(frozen=True, kw_only=True)
class SquaredErrors:
    """Squared errors summed over blocks of time, shape (B,) each."""

    theta: Array  # [rad2]
    theta_abs: Array  # Absolute errors [rad]
    theta_rows: Array
    force: Array  # [N2]
    force_rows: Array

    def pooled(self, weights: Array | None = None) -> Errors:
        """Return errors pooled over all rows, blocks counted with some weights."""
        w = np.ones(len(self.theta)) if weights is None else weights
        rows, forces = float(w @ self.theta_rows), float(w @ self.force_rows)
        return Errors(
            force_rmse=float(np.sqrt(w @ self.force / forces)) if forces else None,
            theta_rmse=float(np.sqrt(w @ self.theta / rows)),
            theta_mae=float(w @ self.theta_abs / rows),
        )


def evaluate_models(study: Study, models: Sequence[Mapping[int, float]]) -> list[SquaredErrors]:
    """Simulate held-out recordings with some models, each given as parameter column -> value.

    Rows that no model can know, such as those after a gap in which the command jumped, are left
    out as they are of fits.
    """
    residuals = study.residuals(*replacements(models))
    parts: list[list[dict[str, Array]]] = [[] for _ in models]
    for recording, residual in ((study.recordings[k], residuals[k]) for k in study.at_servos):
        kept = residual.trusted
        whole = ((recording.time - recording.time[0]) / BLOCK).astype(int)
        block, count = whole[kept], int(whole[-1]) + 1
        rows = np.bincount(block, minlength=count).astype(np.float64)
        for n, part in enumerate(parts):
            theta = residual.theta[n, kept]
            force = np.zeros_like(theta) if residual.force is None else residual.force[n, kept]
            part.append(
                {
                    "theta": group_sums(theta**2, block, count),
                    "theta_abs": group_sums(np.abs(theta), block, count),
                    "theta_rows": rows,
                    "force": group_sums(force**2, block, count),
                    "force_rows": rows if residual.force is not None else 0.0 * rows,
                }
            )
    return [
        SquaredErrors(**{key: np.concatenate([p[key] for p in part]) for key in part[0]})
        for part in parts
    ]


def explained_fraction(before: Errors, after: Errors, noise: NoiseFloor) -> float:
    """Return the share of the squared error above the noise that is gone.

    Signals with a gap count alike; those with none, or hardly any beside the other's, for nothing.
    """
    gaps = list[tuple[float, float]]()
    for top, left, floor in (
        (before.theta_rmse, after.theta_rmse, noise.theta),
        (before.force_rmse, after.force_rmse, noise.force),
    ):
        if top is None or left is None or not floor or top <= WORTH_A_FRACTION * floor:
            continue
        gap = top**2 - floor**2
        gaps.append((gap / floor**2, (top**2 - left**2) / gap))
    least = HARDLY_ANY * max((size for size, _ in gaps), default=0.0)
    shares = [share for size, share in gaps if size >= least]
    return float(np.clip(np.mean(shares), -1.0, 1.0)) if shares else 0.0


def fraction_interval(
    before: SquaredErrors, after: SquaredErrors, noise: NoiseFloor, rng: np.random.Generator
) -> tuple[float, float]:
    """Return the 95 % block-bootstrap interval of `explained_fraction`."""
    count = len(before.theta)
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
