"""Which numbers of a bench moved between two days, by how much and with what probability.

The model of the first day stays as it is but for the numbers that moved. Sets of those are fitted
to the second day, and the one is taken that its recordings are worth.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.special import expit

from tendon_newton.data.model_file import Model
from tendon_newton.data.parameters import BenchScale
from tendon_newton.data.recording import Array, Recording
from tendon_newton.data.servo_names import effect_of
from tendon_newton.diagnosis.diagnose import extended_model
from tendon_newton.diagnosis.evaluation import evaluate_models
from tendon_newton.diagnosis.in_time.log_events import Event
from tendon_newton.diagnosis.in_time.walks import WALKS, walk_of
from tendon_newton.diagnosis.posterior import SURE
from tendon_newton.diagnosis.result import Errors, Estimate
from tendon_newton.diagnosis.search.coordinates import is_shape, sizes
from tendon_newton.diagnosis.search.floors import floors_of
from tendon_newton.diagnosis.search.refit import (
    LAST_SHARE,
    Fit,
    linearise,
    refit,
    row_units,
    start_fits,
    values_of,
)
from tendon_newton.diagnosis.search.search_spans import deciding
from tendon_newton.diagnosis.search.search_worlds import SEARCH_STEP, SearchWorlds
from tendon_newton.effects import EFFECTS, are_related, law_of
from tendon_newton.identification.intervals import WIDENING, half_widths, rows_together
from tendon_newton.identification.linearisation import Linearisation, invertible
from tendon_newton.identification.objective import Layout
from tendon_newton.identification.study import Study, benches_of
from tendon_newton.identification.testable import testable_effects
from tendon_newton.simulation.model.chain_copies import are_apart

DOUBT = 3.0
"""Gain by which a change must be ahead of another to be told from it [nat]: evidence is strong from
there, Kass and Raftery, Bayes factors (1995)."""
MINOR = 0.05
"""Share of what all numbers that moved gain that each must bring [1]: a law that fits a large
change not quite leaves something for others."""
STEPS = 8
"""Steps of a refit at most; a bound on time, as is the next."""
PROMISING = 6
"""Numbers that are tried beside those that moved, of those that promise most."""
Moved = frozenset[str]
"""Causes whose numbers moved."""


@dataclass(frozen=True, kw_only=True)
class Change:
    """One number on both days."""

    cause: str
    """Effect, and the servo that it is of where there are several."""
    name: str
    unit: str
    before: float
    """Value on the first day [unit]."""
    value: float
    """Value on the second day [unit]."""
    ci95: tuple[float, float]
    """95 % interval of the second value, that of the first day taken for granted [unit]."""
    moved: bool
    """Whether the recordings are worth a change."""
    probability: float
    """Probability that it moved [1]."""
    rivals: tuple[str, ...] = ()
    """Causes whose change in place of this one would do as well."""


@dataclass(frozen=True, kw_only=True)
class Changes:
    """What changed since a day."""

    numbers: tuple[Change, ...]
    """Numbers that moved, the greatest gain first, and those that did not."""
    before: Errors
    """Error of the first day's model on recordings of the second day."""
    after: Errors
    """The same of the second day's model."""
    usual: Errors | None
    """Error of the first day's model on that day; None where nobody knows."""
    model: Model
    """Model of the second day."""
    events: tuple[Event, ...] = ()
    """What happened within recordings of the second day."""

    @property
    def moved(self) -> tuple[Change, ...]:
        """Numbers that moved."""
        return tuple(change for change in self.numbers if change.moved)


@dataclass(frozen=True, kw_only=True)
class EarlierDay:
    """What is known of a bench before the days that are held against it."""

    model: Model
    """Model of that day, with what it lacked there."""
    worlds: SearchWorlds | None = None
    """Recordings of that day; None where a diagnosis is all that is left of them."""
    estimates: Mapping[str, Mapping[str, Estimate]] = field(default_factory=dict)
    """Numbers that the diagnosis gives with their intervals, by owner and name."""
    usual: Errors | None = None
    """Error of the model on that day; None where nobody knows."""

    def estimate(self, owner: str, name: str) -> Estimate | None:
        """Return what the diagnosis gives: what it says of all servos, it says of each."""
        own = self.estimates.get(owner) or self.estimates.get(effect_of(owner), {})
        return own.get(name)


def study_day(
    recordings: Sequence[Recording],
    model: Model,
    *,
    walks: Collection[str] = tuple(WALKS),
    effects: Sequence[str] = tuple(EFFECTS),
) -> EarlierDay:
    """Give a model what it lacks, on its own day, of numbers that may move.

    Args:
        recordings: Recordings of the day.
        model: Model of the day; otherwise it stays as it is.
        walks: Effects whose numbers may move, besides the model's own.
        effects: Effects that the kernels hold.

    Raises:
        TendonNewtonError: The recordings or the model cannot be used; the message says why.
    """
    model = for_each_servo(model, recordings)
    worlds = worlds_of(recordings, model, effects, None)
    alone = Days(EarlierDay(model=model, worlds=worlds), worlds, walks)
    if lacking := alone.search():
        model = alone.model_of(lacking)
        worlds = worlds_of(recordings, model, effects, None)
    whole = Study(recordings, model, effects, like=worlds.study)
    (own,) = evaluate_models(whole, [{}])
    return EarlierDay(model=model, worlds=worlds, usual=own.pooled())


def find_changes(
    first: EarlierDay,
    second: Sequence[Recording],
    *,
    unseen: Sequence[Recording] = (),
    walks: Collection[str] = tuple(WALKS),
    effects: Sequence[str] = tuple(EFFECTS),
    progress: Callable[[str], None] = lambda _: None,
) -> Changes:
    """Say which numbers moved since a day.

    Args:
        first: The earlier day.
        second: Recordings of the second day.
        unseen: Recordings of the second day that only report; the same by default.
        walks: Effects whose numbers may have moved, besides the model's own.
        effects: Effects that the kernels hold.
        progress: Told what is being done.

    Raises:
        TendonNewtonError: The recordings or the model cannot be used; the message says why.
    """
    first = replace(first, model=for_each_servo(first.model, second))
    progress("reading the second day")
    scale = None if first.worlds is None else first.worlds.study.scale
    days = Days(first, worlds_of(second, first.model, effects, scale), walks)
    progress(f"trying what may have moved, {len(days.names)} numbers")
    moved = days.search()
    report = Study(unseen or second, first.model, effects, like=days.study)
    before, after = evaluate_models(report, [{}, days.values(moved)])
    return Changes(
        numbers=days.numbers(moved),
        before=before.pooled(),
        after=after.pooled(),
        usual=first.usual,
        model=days.model_of(moved),
    )


def worlds_of(
    recordings: Sequence[Recording], model: Model, effects: Sequence[str], scale: BenchScale | None
) -> SearchWorlds:
    """Return a day's recordings, ready to be searched."""
    parts = deciding(recordings)
    study = Study(parts, model, effects, time_step=SEARCH_STEP, in_pieces=True, scale=scale)
    return SearchWorlds(study)


def for_each_servo(model: Model, recordings: Sequence[Recording]) -> Model:
    """Return a model in which what is said of all servos is said of each: one of them moves."""
    count = recordings[0].tendon_count
    if count == 1:
        return model
    apart = all(are_apart(mechanism) for mechanism in benches_of(recordings, model).values())
    own = {effect.cause for effect in model.effects}
    out = []
    for effect in model.effects:
        shared = effect.servo is None and law_of(effect.name).is_of_servo(apart=apart)
        each = [replace(effect, servo=d) for d in range(count)] if shared else [effect]
        out += [e for e in each if e is effect or e.cause not in own]
    return replace(model, effects=tuple(out))


class Days:
    """Two days of a bench, and the sets of changes between them that were fitted.

    Args:
        earlier: The first day.
        second: Recordings of the second day.
        walks: Effects whose numbers may have moved, besides the model's own.
    """

    def __init__(self, earlier: EarlierDay, second: SearchWorlds, walks: Collection[str]) -> None:
        self.earlier, self.second = earlier, second
        self.first, self.model = earlier.worlds, earlier.model
        self.study = second.study
        self.floors = floors_of(second, ())
        self.names = walking(self.study, walks)
        """Causes whose numbers may have moved."""
        known = [
            *self.study.fit_columns(self.model),
            *(c for name in self.study.known for c in self.study.table.columns(name)),
        ]
        self.spread = {c: self._spread(c) for c in known}
        """Numbers of the first day, column -> what is stated of them [coordinate]."""
        self.fits: dict[Moved, Fit] = {}
        self.fit([frozenset()])

    def _spread(self, column: int) -> float:
        """Return the standard deviation of a number; infinite where recordings say it."""
        if self.first is not None:
            return np.inf
        owner, parameter = self.study.table.owners[column]
        if (found := self.earlier.estimate(owner, parameter.name)) is None:
            return 0.0
        low, high = (self.second.coordinate(column).place(end) for end in found.ci95)
        return abs(high - low) / (2.0 * SURE)

    def strengths(self, name: str) -> tuple[int, ...]:
        """Return the columns of a cause's strengths."""
        return strengths(self.study, name)

    def fit(self, sets: Collection[Moved], start: Moved = frozenset()) -> None:
        """Fit sets of changes, from where the numbers of another set stand.

        What is new begins where the first day had it, or at the best of some typical sizes: what
        sticks hardly changes with a little friction.
        """
        at = self.fits.get(start)
        there = {} if at is None else values_of(self.second, at.columns, at.place)
        starts = []
        for moved in sets:
            columns = [c for name in sorted(moved) for c in self.strengths(name)]
            own = {c: there.get(c, self.study.base_value(c)) for c in columns}
            starts.append((tuple(sorted(moved)), own))
            for column in own.keys() - there.keys():
                sized = [{**own, column: size} for size in sizes(self.study, column)]
                starts += [(tuple(sorted(moved)), values) for values in sized]
        begun = start_fits(self.second, starts, self.floors)
        nearest = {fit.names: fit for fit in sorted(begun, key=lambda fit: -fit.score)}
        for fit in refit(self.second, [*nearest.values()], self.floors, iterations=STEPS):
            self.fits[frozenset(fit.names)] = fit
        best = min(self.fits.values(), key=lambda fit: fit.score).residual
        self.telling = self.second.rows_alone(best) / WIDENING**2
        """Rows of the second day that tell as much as one alone would [1]."""

    def gain(self, moved: Moved) -> float:
        """Return by how much a set is likelier than no change [nat]."""
        return self.telling * (self.fits[frozenset()].score - self.fits[moved].score)

    def worth(self, moved: Moved) -> float:
        """Return what a set gains, its numbers paid for [nat]."""
        minor = MINOR * max(map(self.gain, self.fits))
        return self.gain(moved) - sum(walk_of(name).odds + minor for name in moved)

    def search(self) -> Moved:
        """Return the set of changes that the second day is worth."""
        best: Moved = frozenset()
        self.fit([frozenset([name]) for name in self.names])
        near = [frozenset([name]) for name in self.names]
        while (following := max((best, *near), key=self.worth)) != best:
            best = following
            near = [best | {name} for name in self.promising(best)]
            near += [best - {name} for name in best]
            self.fit([moved for moved in near if moved not in self.fits], best)
        return self.sure(best)

    def promising(self, moved: Moved) -> list[str]:
        """Return the causes that promise most beside some."""
        point = Surroundings(self, moved)
        others = [name for name in self.names if name not in moved]
        return sorted(others, key=lambda name: -point.gain(name))[:PROMISING]

    def sure(self, moved: Moved) -> Moved:
        """Return a set less the causes whose intervals hold that nothing moved."""
        point = Surroundings(self, moved)
        kept = frozenset(name for name in moved if not point.holds_before(name))
        if kept != moved and kept not in self.fits:
            self.fit([kept], moved)
        return kept

    def numbers(self, moved: Moved) -> tuple[Change, ...]:
        """Return what a set of changes says of every number, those that moved first."""
        point = Surroundings(self, moved)
        found = [change for name in self.names for change in point.changes(name)]
        return tuple(sorted(found, key=lambda c: (not c.moved, -c.probability)))

    def values(self, moved: Moved) -> dict[int, float]:
        """Return all numbers of the causes that moved, column -> value."""
        fit, table = self.fits[moved], self.study.table
        found = values_of(self.second, fit.columns, fit.place)
        columns = [c for name in moved for c in table.columns(name)]
        return {c: found.get(c, self.study.base_value(c)) for c in columns}

    def model_of(self, moved: Moved) -> Model:
        """Return the model of the first day with the numbers that moved in place."""
        return extended_model(self.study, self.model, self.values(moved), sorted(moved))

    def chance(self, name: str, moved: Moved) -> float:
        """Return the probability that a number moved, beside a set [1]."""
        with_it, without = moved | {name}, moved - {name}
        if with_it in self.fits and without in self.fits:
            return float(expit(self.worth(with_it) - self.worth(without)))
        return float(expit(Surroundings(self, moved).gain(name) - walk_of(name).odds))

    def rivals(self, name: str, moved: Moved) -> tuple[str, ...]:
        """Return the causes whose change in place of one would do about as well."""
        least = self.worth(moved) - DOUBT
        swapped = {other: (moved - {name}) | {other} for other in self.names if other not in moved}
        return tuple(n for n, s in swapped.items() if s in self.fits and self.worth(s) > least)


class Surroundings:
    """All numbers around one set of changes, those of the first day uncertain with them.

    Args:
        days: Both days.
        moved: The set.
    """

    def __init__(self, days: Days, moved: Moved) -> None:
        self.days, self.moved = days, moved
        known = [c for c, spread in days.spread.items() if spread > 0.0]
        self.walking = [c for name in days.names for c in days.strengths(name)]
        fit = days.fits[moved]
        there = values_of(days.second, fit.columns, fit.place)
        residual, slopes, self.place = around(days, days.second, there, (*known, *self.walking))
        where = days.second.where
        if days.first is not None:
            before, old, _ = around(days, days.first, {}, known)
            old = np.concatenate([old, np.zeros((len(before), len(self.walking)))], axis=1)
            residual, slopes = np.concatenate([residual, before]), np.concatenate([slopes, old])
            where = joined(where, days.first.where)
        self.known, self.where = len(known), where
        self.point = Linearisation(residual=residual, jacobian=slopes)
        self.spread = np.array([*(days.spread[c] for c in known), *(np.inf for _ in self.walking)])
        self.together = rows_together(self.point, where)

    def places(self, names: Collection[str]) -> list[int]:
        """Return the places of the first day's numbers and of the changes of some causes."""
        own = {c for name in names for c in self.days.strengths(name)}
        walking = [self.known + k for k, c in enumerate(self.walking) if c in own]
        return [*range(self.known), *walking]

    def step(self, names: Collection[str]) -> tuple[Array, float]:
        """Return where numbers go once some causes may move, and what that gains [nat]."""
        free = self.places(names)
        hessian = self.point.normal_matrix()[np.ix_(free, free)]
        hessian = hessian + np.diag(self.together / self.spread[free] ** 2)
        slope = -self.point.gradient()[free]
        step = np.linalg.solve(invertible(hessian), slope).astype(np.float64)
        return step, float(0.5 * slope @ step) / self.together / WIDENING**2

    def gain(self, name: str) -> float:
        """Return what another change promises to gain [nat]."""
        step, gain = self.step(self.moved | {name})
        (column, *_), place = self.days.strengths(name), self.places(self.moved | {name})
        k = self.walking.index(column)
        own = self.days.second.coordinate(column)
        to = self.place[k] + step[place.index(self.known + k)]
        return gain - self.step(self.moved)[1] if own.lower <= to <= own.upper else 0.0

    def changes(self, name: str) -> list[Change]:
        """Return the numbers of a cause on both days."""
        days, names = self.days, self.moved | {name}
        free = self.places(names)
        step, _ = self.step(names)
        part = Linearisation(residual=self.point.residual, jacobian=self.point.jacobian[:, free])
        half = half_widths(part, self.where, self.spread[free])
        out = []
        for column in days.strengths(name):
            k = self.walking.index(column)
            at, own = free.index(self.known + k), days.second.coordinate(column)
            place = self.place[k] + (0.0 if name in self.moved else step[at])
            ends = np.clip([place, place - half[at], place + half[at]], own.lower, own.upper)
            value, low, high = (own.value(float(u)) for u in ends)
            parameter = days.study.parameter(column)
            out.append(
                Change(
                    cause=name,
                    name=parameter.name,
                    unit=parameter.unit,
                    before=days.study.base_value(column),
                    value=value,
                    ci95=(min(low, high), max(low, high)),
                    moved=name in self.moved,
                    probability=days.chance(name, self.moved),
                    rivals=days.rivals(name, self.moved) if name in self.moved else (),
                )
            )
        return out

    def holds_before(self, name: str) -> bool:
        """Tell whether the intervals of a cause hold that nothing moved."""
        return all(c.ci95[0] <= c.before <= c.ci95[1] for c in self.changes(name))


def around(
    days: Days, worlds: SearchWorlds, there: Mapping[int, float], columns: Sequence[int]
) -> tuple[Array, Array, Array]:
    """Linearise a day's residuals, in units of what the model leaves.

    Returns:
        Residual, shape (M,); its derivatives by the columns' coordinates, shape (M, F), a column
        that stands twice having two; and the coordinates of the numbers that may move, shape (N,).
    """
    once = tuple(dict.fromkeys(columns))
    values = {c: there.get(c, worlds.study.base_value(c)) for c in once}
    (fit,) = start_fits(worlds, [(days.names, values)], days.floors, near=True)
    unit = row_units(worlds, fit, days.floors, LAST_SHARE, None)
    (jacobian,) = linearise(worlds, [fit])
    order = [once.index(c) for c in columns]
    walking = order[len(columns) - sum(len(days.strengths(n)) for n in days.names) :]
    return fit.residual / unit, (jacobian / unit[:, None])[:, order], fit.place[walking]


def joined(one: Layout, other: Layout) -> Layout:
    """Return the layout of two days' residuals, one after the other."""
    return Layout(
        recording=np.concatenate([one.recording, other.recording + one.recording.max() + 1]),
        block=np.concatenate([one.block, other.block + one.block_count]),
        is_force=np.concatenate([one.is_force, other.is_force]),
        servo=np.concatenate([one.servo, other.servo]),
        block_count=one.block_count + other.block_count,
    )


def walking(study: Study, walks: Collection[str]) -> tuple[str, ...]:
    """Return the causes whose numbers may have moved: those of the model, and what walks.

    Nothing walks whose law is a special case of one in the model, or holds one.
    """
    names = [name for name in study.known if strengths(study, name)]
    for name in testable_effects(study):
        one = len(study.table.columns(name)) == 1
        new = one and law_of(name).name in walks and name not in study.table.by_servo
        if new and not any(are_related(name, other) or name == other for other in names):
            names.append(name)
    return tuple(names)


def strengths(study: Study, name: str) -> tuple[int, ...]:
    """Return the columns of a cause's strengths."""
    own = study.table.columns(name)
    return own if len(own) == 1 else tuple(c for c in own if not is_shape(study.parameter(c)))
