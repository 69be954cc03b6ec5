"""Candidate models simulated on every recording, many at once, and how well each does."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.ndimage import maximum_filter1d

from tendon_newton.data.recording import Array, Mask
from tendon_newton.data.servo_names import effect_of
from tendon_newton.diagnosis.posterior import Coordinate
from tendon_newton.diagnosis.search.coordinates import coordinate_of
from tendon_newton.effects import EFFECTS, law_of
from tendon_newton.effects.base import Stage
from tendon_newton.identification.objective import BLOCK, TAIL, layout, stack
from tendon_newton.identification.signals import Scales
from tendon_newton.identification.study import Study, replacements
from tendon_newton.identification.testable import stated_columns

if TYPE_CHECKING:
    from tendon_newton.diagnosis.search.survey import Column

SANE_FORCE, SANE_ANGLE = 200.0, 20.0
"""A world whose force [N] or angle [rad] is further off than this, on a nominal bench, diverged."""
SEARCH_STEP = 2.0e-3
"""Simulation step of a search and of its decision [s]. Planted sets are 0.1 to 1.6 mrad RMS from
steps of 0.25 ms at it, nearly all of it in some rows after a string went slack or a stop was hit:
`SearchWorlds.look_finer` finds them, and they count less (`docs/lab/method.md`)."""
TRUSTED = 1.0 / 3.0  # Share of its floor by which a row may be missed that counts half [1]
BURST = 3  # Rows either side of one that a finer step moves that count as little [1]
LEAST_CHANGE = 1.0e-3  # Mean change of rows' weights from which scores are taken anew [1]
FINER = 0.4  # Share of the step with which such a world is simulated again [1]
FINEST = 0.1
"""Share of the step with which a model that is left at the end is judged [1]. At the whole step a
finger hits its stop up to a substep late, and is 50 mrad off in a few rows; here it is 5 mrad."""
MOST_NUMBERS = 500_000
"""Residuals that are simulated at once [1]: what kernels write takes some five times the room."""
INDEPENDENT = 2.0
"""Times a second that a model's error tells something of its own [1/s]: where numbers are found on
virtual benches, 26 to 43 rows at 80 Hz tell as much as one alone would."""
SEEN = 0.98
"""Share of the residuals whose size tells how much of them is noise [1]: jumps tell nothing."""
WITHIN = 2.0
"""Tolerances by which a stated number differs as any bench does; beyond it is a cause [1]."""
STILL = 1.0e-9  # Change of the angle from row to row that is none [rad]
NEAR, REST_TIME = 3, 0.035
"""Rows either side without motion that make a row one at rest, and for how long [s] at least: a
slow shaft stays within a count of its encoder for many fast rows."""
PASSES = 8  # Fixed-point passes for a scale; each gains a digit
QUIET = 0.437
"""Score of a signal whose residuals are normal and as large as its floor [nat]: the mean of
9/2 log(1 + z^2 / 9) for a standard normal z."""


@dataclass(frozen=True, kw_only=True)
class Floors(Scales):
    """What a model that is right leaves: the least scale of each signal's residuals."""

    rest: float = 1.0
    """Weight of a row at rest [1]: a stuck tendon repeats one error in all of them."""


@dataclass(frozen=True, kw_only=True)
class WorldScore:
    """How likely residuals are, per row, with the scale of each signal at its best."""

    value: Array  # Negative log likelihood per row, summed over signals [nat], shape (N,)
    scales: Array
    """Scale of each signal's residuals, in its unit; zero where no row counts, shape (N, S)."""


class SearchWorlds:
    """Simulates candidates and counts what it simulated.

    Args:
        study: Training recordings, with kernels that hold the whole catalogue.
    """

    def __init__(self, study: Study) -> None:
        self.study = study
        self.where = layout(study)
        self.count = 0
        self.bench_slopes: Mapping[int, Array] = {}
        """Derivatives of the residual by the numbers of benches that move little, shape (M,) each:
        they hardly change from set to set. A survey takes them anew."""
        self.last_surveyed: tuple[Hashable, tuple[tuple[Column, ...], Array]] | None = None
        """The last place that a survey looked around, and the directions that it saw."""
        self.stated = frozenset(stated_columns(study))
        """Numbers of effects that something states, with a tolerance: free in every fit."""
        self.built_columns = (*study.tolerated_columns, *sorted(self.stated))
        """Numbers that differ a little on every bench, and are no cause for that."""
        self._clock = clock_of(study)
        self._coordinates: dict[int, Coordinate] = {}
        self._stated_at: dict[int, tuple[float, float]] = {}
        self.step_error = np.zeros(len(self.where.signal))
        """By how much the search's steps miss finer ones [rad, N], shape (M,): `look_finer`."""
        self._rests = rests(study)
        resting = max(1, int(self._rests.sum()))
        self.rest_share = min(1.0, (len(self._rests) - resting) / resting)
        """Weight of a row at rest with which rest counts at most as much as motion [1]."""

    def coordinate(self, column: int) -> Coordinate:
        """Return the coordinate of one column."""
        if column not in self._coordinates:
            self._coordinates[column] = coordinate_of(self.study, column)
        return self._coordinates[column]

    def as_built(self, column: int) -> tuple[float, float]:
        """Return the least and greatest coordinate of a stated number within its tolerance."""
        stated, spread = self.stated_at(column)
        return stated - WITHIN * spread, stated + WITHIN * spread

    def stated_at(self, column: int) -> tuple[float, float]:
        """Return what is stated of a number and its tolerance, as coordinates.

        The tolerance is infinite where nothing states a number.
        """
        if column not in self._stated_at:
            tolerance, own = self.study.parameter(column).tolerance, self.coordinate(column)
            stated, spread = 0.0, np.inf
            if tolerance > 0.0:
                stated = own.place(self.study.base_value(column))
                spread = (np.log1p(tolerance) if own.kind == "log" else tolerance) / own.unit
            self._stated_at[column] = stated, float(spread)
        return self._stated_at[column]

    def spreads(self, columns: Sequence[int], names: Sequence[str]) -> Array:
        """Return the tolerances of numbers, as coordinates, shape (F,).

        The tolerance is infinite where nothing states a number, and where its effect is among the
        causes: these are paid for as such.

        Args:
            columns: Places of the numbers.
            names: Causes.
        """
        owners = self.study.table.owners
        return np.array(
            [np.inf if owners[c][0] in names else self.stated_at(c)[1] for c in columns]
        )

    def rows_together(self, residual: Array, floors: Floors) -> float:
        """Return how many rows tell as much as one alone would [1].

        Sensors err from row to row, and a model errs for a while: the share of the squared residual
        that is not the sensors' counts once in so many rows. At a floor that is a law's own error.
        """
        noise, shares = self.study.noise, list[float]()
        for signal, own in self.where.signals:
            size = max(floors.of(signal), trimmed_size(residual[own], SEEN))
            shares.append(1.0 - (noise.of(signal) / size) ** 2)
        rows = len(residual) / len(shares) / (BLOCK * self.where.block_count)
        return 1.0 + float(np.mean(shares)) * max(0.0, rows / INDEPENDENT - 1.0)

    def rows_alone(self, residual: Array, floors: Floors) -> float:
        """Return how many rows that err alone would tell as much as a signal's rows do [1]."""
        return len(residual) / len(self.where.signals) / self.rows_together(residual, floors)

    def with_stated(self, values: Mapping[int, float], names: Sequence[str]) -> dict[int, float]:
        """Return a set's free numbers, column -> value, with those that stand beside its causes.

        These are what is stated, and what each further bench has of a line's effects.
        """
        study = self.study
        own = study.line_columns(names)
        others = {*study.line_columns(EFFECTS)} - {*own}
        free = {c: study.base_value(c) for c in (*self.stated, *own)}
        free |= {c: v for c, v in values.items() if c not in others}
        return {c: null if (null := self.idle_at(c, names)) is not None else v
                for c, v in free.items()}  # fmt: skip

    def idle_at(self, column: int, names: Sequence[str]) -> float | None:
        """Return where a number stays that does nothing in a set of causes, None for others."""
        study, parameter = self.study, self.study.table.owners[column][1]
        acts = study.frees_spools and parameter.needs in {*map(effect_of, names), *study.known}
        return None if acts or not parameter.needs else parameter.null

    def in_seconds(self, values: Mapping[int, float], way: int = 1) -> dict[int, float]:
        """Return numbers, column -> value, that are in seconds of a log's clock in true ones.

        Sets are fitted in the log's clock: a wrong clock moves no event of the log, and causes
        found beside it are what they are without it. What is stated is in true seconds.

        Args:
            values: Column -> value.
            way: -1 for the way back.
        """
        out = dict(values)
        if self._clock in values:
            scale = (values[self._clock] / self.study.base_value(self._clock)) ** way
            for c in values.keys() - self.stated:
                out[c] *= scale ** self.study.parameter(c).time_power
        return out

    def finest(self, model: Mapping[int, float]) -> Array:
        """Return measured minus simulated [rad, N] of one model at the finest step, shape (M,)."""
        step = FINEST * self.study.time_step
        return stack(self.study.residuals(*replacements([self.in_seconds(model)]), step))[0]

    def look_finer(self, model: Mapping[int, float], floors: Floors) -> bool:
        """Find the rows in which the search's step misses the finest one with a model.

        What one model showed is kept: rows of all that were looked at count less.

        Returns:
            Whether rows count otherwise now.
        """
        before, known = self.weights(floors), self.step_error
        missed = np.nan_to_num(np.abs(self.residuals([model])[0] - self.finest(model)))
        self.step_error = np.maximum(known, maximum_filter1d(missed, 2 * BURST + 1))
        if np.abs(self.weights(floors) - before).mean() < LEAST_CHANGE:
            self.step_error = known
        return self.step_error is not known

    def residuals(self, models: Sequence[Mapping[int, float]]) -> Array:
        """Return measured minus simulated [rad, N] of candidates, shape (N, M).

        Args:
            models: Column -> value in place of the starting model's, for each candidate, in the
                log's clock.
        """
        models = [self.in_seconds(model) for model in models]
        width = max(1, MOST_NUMBERS // len(self.where.signal))
        out = np.empty((len(models), len(self.where.signal)))
        for at in range(0, len(models), width):
            out[at : at + width] = self._simulate(models[at : at + width])
        return out

    def _simulate(self, models: Sequence[Mapping[int, float]]) -> Array:
        found = stack(self.study.residuals(*replacements(models)))
        self.count += len(models)
        wild = np.flatnonzero(self.is_wild(found))
        if len(wild):
            again = [models[i] for i in wild.tolist()]
            step = FINER * self.study.time_step
            found[wild] = stack(self.study.residuals(*replacements(again), step))
            self.count += len(again)
        return found

    def is_wild(self, residuals: Array) -> Mask:
        """Tell which candidates left a sane range, shape (N,)."""
        force = SANE_FORCE * self.study.scale.force
        angle = SANE_ANGLE * max(1.0, self.study.scale.turn * self.study.scale.travel)
        limit = self.where.sizes(self.study.form(Scales(theta=angle, force=force)))
        return np.array([(np.abs(own) > limit).any() for own in residuals], dtype=np.bool_)

    def weights(self, floors: Floors) -> Array:
        """Return how much each row counts [1], shape (M,).

        One that the step of the search may miss by a share `TRUSTED` of its floor counts half.
        """
        missed = self.step_error / (TRUSTED * self.where.sizes(floors))
        return np.where(self._rests, floors.rest, 1.0) / (1.0 + missed**2)

    def score(self, residuals: Array, floors: Floors, rows: Mask | None = None) -> WorldScore:
        """Return how likely residuals are, shape (N, M).

        Each signal's density falls off like Student's, with the most likely scale that is not below
        what noise and form errors leave.

        Args:
            residuals: Measured minus simulated [rad, N], shape (N, M).
            floors: Least scale of each signal.
            rows: Rows that count, shape (M,); all by default.
        """
        value, scales, weights = np.zeros(len(residuals)), [], self.weights(floors)
        for signal, own in self.where.signals:
            floor, chosen = floors.of(signal), own if rows is None else own & rows
            if not chosen.any():
                scales.append(np.zeros(len(residuals)))
                continue
            square, weight = residuals[:, chosen] ** 2, weights[chosen] / weights[chosen].sum()
            scale = likely_scale(square, weight, floor)
            tail = 0.5 * TAIL**2 * np.log1p(square / (TAIL * scale[:, None]) ** 2)
            value += np.log(scale / floor) + tail @ weight
            scales.append(scale)
        return WorldScore(value=value, scales=np.stack(scales, axis=1))


def clock_of(study: Study) -> int:
    """Return the place of the number of a wrong clock; -1 where the catalogue has none."""
    owners = [owner for owner, _ in study.table.owners]
    clocks = [c for c, owner in enumerate(owners) if owner in study.table.effects
              and law_of(owner).hook(Stage.PERIOD)]  # fmt: skip
    return next(iter(clocks), -1)


def likely_scale(square: Array, weight: Array, floor: float) -> Array:
    """Return the most likely scale of squared residuals, at least a floor, shape (N,)."""
    variance = np.maximum(square @ weight, floor**2)
    for _ in range(PASSES):
        kept = square / (1.0 + square / (TAIL**2 * variance[:, None]))
        variance = np.maximum(kept @ weight, floor**2)
    return np.sqrt(variance)


def rests(study: Study) -> Mask:
    """Tell on which rows the encoder stands still, in the order of residuals, shape (M,)."""
    out = []
    for index, recording in enumerate(study.recordings):
        moves = np.abs(np.diff(recording.motor_position[:, 0], prepend=np.nan)) > STILL
        step = float(np.median(np.diff(recording.time)))
        reach = min(max(NEAR, int(REST_TIME / step)), (len(moves) - 1) // 2)
        near = np.convolve(moves, np.ones(2 * reach + 1), mode="same") > 0.0
        rest = ~near[study.timeline(index).trusted]
        out += [rest] * sum(map(len, study.compared[index].values()))
    return np.concatenate(out)


def trimmed_size(residual: Array, share: float) -> float:
    """Return the root mean square of the smaller residuals, which are that share [1] of all."""
    square = residual**2
    if share < 1.0:
        kept = max(1, int(share * len(square)))
        square = np.partition(square, kept - 1)[:kept]
    return float(np.sqrt(square.mean()))
