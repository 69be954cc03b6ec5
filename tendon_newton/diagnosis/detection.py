"""Is there a gap at all? The best gain against what chance gives with noise of the same colour."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tendon_newton.data.recording import Array
from tendon_newton.diagnosis.greedy import Fit, Search
from tendon_newton.identification.least_squares import invertible
from tendon_newton.identification.objective import loss_terms, loss_weights

SURROGATES = 200
"""Noise records that the best gain is compared with; the least p-value is one in so many."""


def gain_p_value(
    search: Search, fits: Sequence[Fit], current: Fit, rng: np.random.Generator
) -> float:
    """Return the chance of such a gain on held-out folds when there is nothing to find.

    The surrogates have each channel's amplitude spectrum and random phases, so that the null has
    the residual's own autocorrelation; the residual is that of the best candidate, so that the gap
    itself is not taken for noise. Each candidate is then refitted to each surrogate fold by fold,
    to first order. The largest gain over all candidates counts: looking at many causes is part of
    the null.
    """
    observed = max(current.loss - fit.loss for fit in fits)
    residual = fits[0].point.residual
    # What counts is the robust loss, so the noise has its size: r^2 / 2 = loss.
    noise = surrogates(search, np.sign(residual) * np.sqrt(2.0 * loss_terms(residual)), rng)
    best = np.zeros(SURROGATES)
    for fit in fits:
        best = np.maximum(best, surrogate_gains(search, fit, noise))
    return float((1 + np.sum(best >= observed)) / (SURROGATES + 1))


def surrogates(search: Search, residual: Array, rng: np.random.Generator) -> Array:
    """Return noise with the spectrum of each recording's and channel's residual, shape (B, M)."""
    out = np.zeros((SURROGATES, len(residual)))
    where = search.where
    for recording in np.unique(where.recording):
        for force in (False, True):
            rows = np.flatnonzero((where.recording == recording) & (where.is_force == force))
            if len(rows) < 3:
                continue
            spectrum = np.abs(np.fft.rfft(residual[rows]))
            phase = rng.uniform(0.0, 2.0 * np.pi, (SURROGATES, len(spectrum)))
            out[:, rows] = np.fft.irfft(spectrum * np.exp(1j * phase), n=len(rows), axis=1)
    return out


def surrogate_gains(search: Search, fit: Fit, noise: Array) -> Array:
    """Return the held-out gain of refitting a candidate to each noise record, shape (B,).

    The refit is of first order. A parameter starts at what the current model has, and stays in its
    range: friction cannot turn negative.
    """
    candidate = fit.candidate
    jacobian = np.sqrt(loss_weights(fit.point.residual))[:, None] * fit.point.jacobian
    start = np.array([search.study.base_value(c) for c in candidate.columns])[:, None]
    start = np.clip(start, candidate.lower[:, None], candidate.upper[:, None])
    gains = np.zeros(len(noise))
    for fold in range(search.folds.count):
        left_out = search.folds.of_entry == fold
        seen = jacobian[~left_out]
        step = np.linalg.solve(invertible(seen.T @ seen), seen.T @ noise[:, ~left_out].T)
        step = np.clip(start - step, candidate.lower[:, None], candidate.upper[:, None]) - start
        change = (jacobian[left_out] @ step).T
        before = noise[:, left_out]
        gains += 0.5 * np.sum(before**2 - (before + change) ** 2, axis=1)
    return gains
