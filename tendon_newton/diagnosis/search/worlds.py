"""Candidate models simulated on every recording, many at once, and how well each does."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tendon_newton.data.recording import Array, Mask
from tendon_newton.diagnosis.search.coordinates import Coordinate, coordinate_of
from tendon_newton.identification.objective import TAIL, Scales, layout, stack
from tendon_newton.identification.study import Study, replacements

UNIT = Scales(theta=1.0, force=1.0)
"""Residuals in their own units."""
SANE_FORCE, SANE_ANGLE = 200.0, 20.0
"""A world whose force [N] or angle [rad] is further off than this, on a nominal bench, diverged."""
FINER = 0.4
"""Share of the step with which such a world is simulated again [1]."""
MOST_NUMBERS = 30_000_000
"""Residuals held at once [1]; more worlds are simulated in turns."""
PASSES = 8
"""Fixed-point passes for a scale; each gains a digit."""


@dataclass(frozen=True, kw_only=True)
class Score:
    """How likely residuals are, per row, with the scale of each signal at its best."""

    value: Array
    """Negative log likelihood per row, summed over signals [nat], shape (N,)."""
    theta: Array
    """Scale of the angle's residuals [rad], shape (N,)."""
    force: Array
    """The same of the force [N]; zero without a load cell, shape (N,)."""


class Worlds:
    """Simulates candidates and counts what it simulated.

    Args:
        study: Training recordings, with kernels that hold the whole catalogue.
    """

    def __init__(self, study: Study) -> None:
        self.study = study
        self.where = layout(study)
        self.count = 0
        self._coordinates: dict[int, Coordinate] = {}

    def coordinate(self, column: int) -> Coordinate:
        """Return the coordinate of one column."""
        if column not in self._coordinates:
            self._coordinates[column] = coordinate_of(self.study, column)
        return self._coordinates[column]

    def residuals(self, models: Sequence[Mapping[int, float]], time_step: float) -> Array:
        """Return measured minus simulated [rad, N] of candidates, shape (N, M).

        Args:
            models: Column -> value in place of the starting model's, for each candidate.
            time_step: Of the simulation [s].
        """
        width = max(1, MOST_NUMBERS // len(self.where.is_force))
        parts = [
            self._simulate(models[at : at + width], time_step)
            for at in range(0, len(models), width)
        ]
        return np.concatenate(parts)

    def _simulate(self, models: Sequence[Mapping[int, float]], time_step: float) -> Array:
        found = stack(self.study.residuals(*replacements(models), time_step), UNIT)
        self.count += len(models)
        wild = np.flatnonzero(self.is_wild(found))
        if len(wild):
            again = [models[i] for i in wild]
            found[wild] = stack(self.study.residuals(*replacements(again), FINER * time_step), UNIT)
            self.count += len(again)
        return found

    def is_wild(self, residuals: Array) -> Mask:
        """Tell which candidates left a sane range, shape (N,)."""
        force = SANE_FORCE * self.study.scale.force
        angle = SANE_ANGLE * max(1.0, self.study.scale.turn * self.study.scale.travel)
        limit = np.where(self.where.is_force, force, angle)
        return (np.abs(residuals) > limit).any(axis=1)

    def score(self, residuals: Array, floors: Scales, rows: Mask | None = None) -> Score:
        """Return how likely residuals are, shape (N, M).

        Each signal's density falls off like Student's, with the most likely scale that is not below
        what noise and form errors leave.

        Args:
            residuals: Measured minus simulated [rad, N], shape (N, M).
            floors: Least scale of each signal.
            rows: Rows that count, shape (M,); all by default.
        """
        value, scales = np.zeros(len(residuals)), []
        for force, floor in ((False, floors.theta), (True, floors.force)):
            chosen = self.where.is_force == force
            chosen = chosen if rows is None else chosen & rows
            if not chosen.any():
                scales.append(np.zeros(len(residuals)))
                continue
            square = residuals[:, chosen] ** 2
            scale = likely_scale(square, floor)
            tail = 0.5 * TAIL**2 * np.log1p(square / (TAIL * scale[:, None]) ** 2)
            value += np.log(scale / floor) + tail.mean(axis=1)
            scales.append(scale)
        return Score(value=value, theta=scales[0], force=scales[1])


def likely_scale(square: Array, floor: float) -> Array:
    """Return the most likely scale of squared residuals, at least a floor, shape (N,)."""
    variance = np.maximum(square.mean(axis=1), floor**2)
    for _ in range(PASSES):
        kept = square / (1.0 + square / (TAIL**2 * variance[:, None]))
        variance = np.maximum(kept.mean(axis=1), floor**2)
    return np.sqrt(variance)
