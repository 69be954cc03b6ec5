"""Which numbers of a bench moved between two days, by how much and with what probability.

The model of the first day stays as it is but for the numbers that moved. Sets of those are fitted
to the second day, and the one is taken that its recordings are worth.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.special import expit

from tendon_newton.data.model_file import Model
from tendon_newton.data.parameters import BenchScale
from tendon_newton.data.recording import Recording
from tendon_newton.data.servo_names import effect_of
from tendon_newton.diagnosis.diagnose import extended_model
from tendon_newton.diagnosis.evaluation import evaluate_models
from tendon_newton.diagnosis.in_time.log_events import Event
from tendon_newton.diagnosis.in_time.surroundings import Surroundings, strengths
from tendon_newton.diagnosis.in_time.walks import WALKS, walk_of
from tendon_newton.diagnosis.posterior import SURE
from tendon_newton.diagnosis.result import Errors, Estimate
from tendon_newton.diagnosis.search.coordinates import sizes
from tendon_newton.diagnosis.search.decide.extent import deciding
from tendon_newton.diagnosis.search.floors import floors_of
from tendon_newton.diagnosis.search.refit import Fit, refit, start_fits, values_of
from tendon_newton.diagnosis.search.search_worlds import SEARCH_STEP, SearchWorlds
from tendon_newton.effects import EFFECTS, are_related, law_of
from tendon_newton.errors import unknown_name
from tendon_newton.identification.intervals import SHARED_FORM
from tendon_newton.identification.study import Study, benches_of
from tendon_newton.identification.testable import testable_effects
from tendon_newton.simulation.model.chain_copies import are_independent

DOUBT = 3.0
"""Gain by which a change must be ahead of another to be told from it [nat]: evidence is strong from
there, Kass and Raftery, Bayes factors (1995)."""
CLEAR = 5.0
"""Gain beyond its price by which a change is clear, however wide its interval [nat]: evidence is
very strong from there, by the same authors. A law that fits a large change not quite has a wide
one."""
MINOR = 0.05
"""Share of what all numbers that moved gain that each must bring [1]: a law that fits a large
change not quite leaves something for others."""
MENDED = 0.95
"""Probability from which a mend has moved its number: several that were mended may make up for each
other within their intervals, and yet none can have stayed."""
PROMISED = 1.4
"""Logarithm of the odds that a mend moves its number [nat]: four of five names of a diagnosis are
deserved, by docs/lab/exams.md."""
STEPS = 8  # Steps of a refit at most; a bound on time, as is the next
PROMISING = 6  # Numbers that are tried beside those that moved, of those that promise most
Moved = frozenset[str]  # Causes whose numbers moved


@dataclass(frozen=True, kw_only=True)
class Change:
    """One number on both days."""

    cause: str  # Effect, and the servo that it is of where there are several
    name: str
    unit: str
    before: float  # Value on the first day [unit]
    value: float  # Value on the second day [unit]
    ci95: tuple[float, float]
    """95 % interval of the second value, that of the first day taken for granted [unit]."""
    moved: bool  # Whether the recordings are worth a change
    probability: float  # Probability that it moved [1]
    rivals: tuple[str, ...] = ()  # Causes whose change in place of this one would do as well
    mended: bool = False  # Whether somebody says that it was mended in between


@dataclass(frozen=True, kw_only=True)
class Changes:
    """What changed since a day."""

    numbers: tuple[Change, ...]
    """Numbers that moved, the greatest gain first, and those that did not."""
    before: Errors  # Error of the first day's model on recordings of the second day
    after: Errors  # Error of the second day's model on them
    usual: Errors | None  # Error of the first day's model on that day; None where nobody knows
    model: Model  # Model of the second day
    events: tuple[Event, ...] = ()  # What happened within recordings of the second day

    @property
    def moved(self) -> tuple[Change, ...]:
        """Numbers that moved."""
        return tuple(change for change in self.numbers if change.moved)


@dataclass(frozen=True, kw_only=True)
class EarlierDay:
    """What is known of a bench before the days that are held against it."""

    model: Model  # Model of that day, with what it lacked there
    worlds: SearchWorlds | None = None
    """Recordings of that day; None where a diagnosis is all that is left of them."""
    estimates: Mapping[str, Mapping[str, Estimate]] = field(default_factory=dict)
    """Numbers that the diagnosis gives with their intervals, by owner and name."""
    usual: Errors | None = None  # Error of the model on that day; None where nobody knows

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
    mended: Collection[str] = (),
    walks: Collection[str] = tuple(WALKS),
    effects: Sequence[str] = tuple(EFFECTS),
    progress: Callable[[str], None] = lambda _: None,
) -> Changes:
    """Say which numbers moved since a day.

    Args:
        unseen: Recordings of the second day that only report; the same by default.
        mended: Causes that somebody mended in between: their numbers are measured, whatever they
            are worth.
        walks: Effects whose numbers may have moved, besides the model's own.
        effects: Effects that the kernels hold.

    Raises:
        TendonNewtonError: The recordings or the model cannot be used; the message says why.
    """
    first = replace(first, model=for_each_servo(first.model, second))
    progress("reading the second day")
    scale = None if first.worlds is None else first.worlds.study.scale
    days = Days(first, worlds_of(second, first.model, effects, scale), walks, mended)
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
    study = Study(parts, model, effects, time_step=SEARCH_STEP, in_segments=True, scale=scale)
    return SearchWorlds(study)


def for_each_servo(model: Model, recordings: Sequence[Recording]) -> Model:
    """Return a model in which what is said of all servos is said of each: one of them moves."""
    count = recordings[0].tendon_count
    if count == 1:
        return model
    independent = all(
        are_independent(mechanism) for mechanism in benches_of(recordings, model).values()
    )
    own = {effect.cause for effect in model.effects}
    out = []
    for effect in model.effects:
        shared = effect.servo is None and law_of(effect.name).is_of_servo(independent=independent)
        each = [replace(effect, servo=d) for d in range(count)] if shared else [effect]
        out += [e for e in each if e is effect or e.cause not in own]
    return replace(model, effects=tuple(out))


class Days:
    """Two days of a bench, and the sets of changes between them that were fitted.

    Args:
        walks: Effects whose numbers may have moved, besides the model's own.
    """

    def __init__(
        self,
        earlier: EarlierDay,
        second: SearchWorlds,
        walks: Collection[str],
        mended: Collection[str] = (),
    ) -> None:
        self.earlier, self.second = earlier, second
        self.first, self.model = earlier.worlds, earlier.model
        self.study = second.study
        self.floors = floors_of(second, ())
        self.names = walking(self.study, walks)  # Causes whose numbers may have moved
        self.mended = frozenset(n for name in mended for n in meant(name, self.names))
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

    def around(self, moved: Moved) -> Surroundings:
        """Return all numbers around a set of changes."""
        fit = self.fits[moved]
        return Surroundings(self.first, self.second, self.floors, self.names, fit, self.spread)

    def fit(self, sets: Collection[Moved], start: Moved = frozenset()) -> None:
        """Fit sets of changes that are not yet, from where the numbers of another set stand.

        What is new begins where the first day had it, or at the best of some typical sizes: what
        sticks hardly changes with a little friction.
        """
        at = self.fits.get(start)
        there = {} if at is None else values_of(self.second, at.columns, at.place)
        starts = []
        for moved in dict.fromkeys(each for each in sets if each not in self.fits):
            columns = [c for name in sorted(moved) for c in strengths(self.study, name)]
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
        self.telling = self.second.rows_alone(best, self.floors) / SHARED_FORM**2
        """Rows of the second day that tell as much as one alone would [1]."""

    def gain(self, moved: Moved) -> float:
        """Return by how much a set is likelier than no change [nat]."""
        return self.telling * (self.fits[frozenset()].score - self.fits[moved].score)

    def worth(self, moved: Moved) -> float:
        """Return what a set gains, its numbers paid for and promises kept [nat]."""
        minor = MINOR * max(map(self.gain, self.fits))
        price = sum(walk_of(n).odds + minor for n in moved - self.mended)
        return self.gain(moved) + PROMISED * len(moved & self.mended) - price

    def search(self) -> Moved:
        """Return the set of changes that the second day is worth."""
        best = self.mended
        self.fit([best])
        near = [best | {name} for name in self.names]
        self.fit(near, best)
        while (following := max((best, *near), key=self.worth)) != best:
            best = following
            near = [best | {name} for name in self.promising(best)]
            near += [best - {name} for name in best - self.mended]
            self.fit(near, best)
        kept = self.sure(best)
        self.fit([kept - {name} for name in self.mended], kept)
        return kept

    def promising(self, moved: Moved) -> list[str]:
        """Return the causes that promise most beside some."""
        point = self.around(moved)
        others = [name for name in self.names if name not in moved]
        return sorted(others, key=lambda name: -point.gain(name))[:PROMISING]

    def sure(self, moved: Moved) -> Moved:
        """Return a set less the causes whose intervals hold that nothing moved, unless it is clear.

        One goes after the other, the one that is missed least: several that make up for each other
        have wide intervals, and yet not all of them stayed. Where an answer is all that is left of
        the first day, what it leaves open decides: nothing is clear then.
        """
        point = self.around(moved)
        fewer = [moved - {n} for n in moved - self.mended if point.holds_before(n)]
        self.fit(fewer, moved)
        best = max(fewer, key=self.worth, default=moved)
        clear = self.first is not None and self.worth(moved) - self.worth(best) > CLEAR
        if best == moved or clear:
            return moved
        return self.sure(best)

    def numbers(self, moved: Moved) -> tuple[Change, ...]:
        """Return what a set of changes says of every number, those that moved first."""
        point = self.around(moved)
        found = [change for name in self.names for change in self.changes(name, point)]
        return tuple(sorted(found, key=lambda c: (not c.moved, -c.probability)))

    def changes(self, name: str, point: Surroundings) -> list[Change]:
        """Return the numbers of a cause on both days, beside a set."""
        moved, probability = name in point.moved, self.chance(name, point)
        if name in self.mended:
            moved = probability > MENDED
        rivals = self.rivals(name, point.moved) if moved else ()
        return [
            Change(
                cause=name,
                name=self.study.parameter(column).name,
                unit=self.study.parameter(column).unit,
                before=self.study.base_value(column),
                value=value,
                ci95=(low, high),
                moved=moved,
                probability=probability,
                rivals=rivals,
                mended=name in self.mended,
            )
            for column, (value, low, high) in point.estimates(name).items()
        ]

    def values(self, moved: Moved) -> dict[int, float]:
        """Return all numbers of the causes that moved, column -> value."""
        fit, table = self.fits[moved], self.study.table
        found = values_of(self.second, fit.columns, fit.place)
        columns = [c for name in moved for c in table.columns(name)]
        return {c: found.get(c, self.study.base_value(c)) for c in columns}

    def model_of(self, moved: Moved) -> Model:
        """Return the model of the first day with the numbers that moved in place."""
        return extended_model(self.study, self.model, self.values(moved), sorted(moved))

    def chance(self, name: str, point: Surroundings) -> float:
        """Return the probability that a number moved, beside a set [1]."""
        with_it, without = point.moved | {name}, point.moved - {name}
        if with_it in self.fits and without in self.fits:
            return float(expit(self.worth(with_it) - self.worth(without)))
        return float(expit(point.gain(name) - walk_of(name).odds))

    def rivals(self, name: str, moved: Moved) -> tuple[str, ...]:
        """Return the causes whose change in place of one would do about as well."""
        least = self.worth(moved) - DOUBT
        swapped = {other: (moved - {name}) | {other} for other in self.names if other not in moved}
        return tuple(n for n, s in swapped.items() if s in self.fits and self.worth(s) > least)


def meant(name: str, walks: Sequence[str]) -> list[str]:
    """Return the causes that a name means: of each servo, and as the model has their law.

    Raises:
        UnknownName: None of them may have moved; the message lists those that may.
    """
    found = [own for own in walks if name in (own, effect_of(own))]
    found = found or [own for own in walks if are_related(name, own)]
    if not found:
        raise unknown_name("number that may have been mended", name, walks)
    return found


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
