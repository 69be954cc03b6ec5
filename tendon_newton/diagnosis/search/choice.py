"""Sparse sets of causes chosen on a survey's quadratic, without simulating."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from tendon_newton.data.recording import Array
from tendon_newton.diagnosis.search.survey import Survey
from tendon_newton.effects import are_related, law_of
from tendon_newton.identification.quadratic import bounded

CLOSER = 6  # Directions that are solved for, of those that promise most to one step of a set
ROUNDS = 3  # Times that the weights of the signals are renewed while a set is solved for
FORCED = 4  # Single causes of which each is forced into a set
PROMISE = 0.2
"""Share of what a cause is worth that another must promise to be tried in its place [1]."""
MOST_STEPS = 20  # Additions, removals and exchanges of one choice


@dataclass(frozen=True, kw_only=True)
class Trial:
    """A set of directions with its coefficients."""

    added: tuple[int, ...]  # Atoms
    removed: tuple[str, ...]  # Effects of the fit that go
    coefficients: dict[int, float]  # Direction -> coefficient
    score: float  # Score that the quadratic predicts [nat per row]


class Chooser:
    """Chooses sets on one survey.

    Args:
        survey: The quadratic.
        price: Gain in score [nat per row] that each number of a further cause must promise.
        most: Causes at most.
    """

    def __init__(self, survey: Survey, price: float, most: int) -> None:
        self.survey, self.price, self.most = survey, price, most
        kinds = [c.kind for c in survey.columns]
        self.atoms = np.array([i for i, kind in enumerate(kinds) if kind == "atom"], dtype=int)
        self.slopes = [i for i, kind in enumerate(kinds) if kind == "slope"]
        self.removals = {c.name: i for i, c in enumerate(survey.columns) if c.kind == "removal"}
        everything = {*survey.fit.names, *(c.name for c in survey.columns if c.name)}
        self.numbers = {name: len(law_of(name).parameters) for name in everything}
        self.relatives = {
            name: frozenset(other for other in everything if are_related(name, other))
            for name in everything
        }
        """Special cases of each cause, and what it is a special case of."""
        self._low = np.array([c.low for c in survey.columns])
        self._high = np.array([c.high for c in survey.columns])
        self._cache: dict[tuple[tuple[int, ...], tuple[str, ...]], Trial] = {}

    def solve(self, added: Iterable[int], removed: Iterable[str]) -> Trial:
        """Return a set with its best coefficients."""
        key = (tuple(sorted(added)), tuple(sorted(removed)))
        if key not in self._cache:
            self._cache[key] = self._solve(*key)
        return self._cache[key]

    def _solve(self, added: tuple[int, ...], removed: tuple[str, ...]) -> Trial:
        s = self.survey
        free = np.array(
            [*added, *(i for i in self.slopes if s.columns[i].name not in removed)], dtype=int
        )
        slope, square = self._without(removed)
        slope, left = slope[:, free], square
        gram = s.gram[:, free[:, None], free]
        low, high = self._low[free], self._high[free]
        x = np.zeros(len(free))
        for _ in range(ROUNDS):
            weight = self._weights(left)
            x = bounded(np.tensordot(weight, gram, 1), -(weight @ slope), low, high)
            left = square + (2.0 * slope + gram @ x) @ x
        return Trial(
            added=added, removed=removed,
            coefficients=dict(zip(free.tolist(), x.tolist(), strict=True)), score=self.score(left),
        )  # fmt: skip

    def _without(self, removed: Iterable[str]) -> tuple[Array, Array]:
        """Return products with the residual, and its squares, once effects of the fit are gone."""
        s = self.survey
        gone = np.array([self.removals[name] for name in removed], dtype=int)
        slope = s.slope + s.gram[:, :, gone].sum(axis=2)
        square = s.square + (s.slope + slope)[:, gone].sum(axis=1)
        return slope, square

    def _variances(self, left: Array) -> Array:
        rows = np.maximum(self.survey.rows, 1.0e-9)
        return np.maximum(left, 0.0) / rows / self.survey.floors**2 + 1.0

    def _weights(self, left: Array) -> Array:
        rows = np.maximum(self.survey.rows, 1.0e-9)
        weight = 1.0 / (rows * self.survey.floors**2 * self._variances(left))
        return np.where(self.survey.rows > 0.0, weight, 0.0)

    def score(self, left: Array) -> float:
        """Return the score of squared residuals by signal [nat per row]."""
        return float(np.sum(0.5 * np.log(self._variances(left)) * (self.survey.rows > 0.0)))

    def cost(self, trial: Trial) -> float:
        """Return a set's score with the price of all numbers of its causes."""
        return trial.score + self.price * sum(self.numbers[name] for name in self.names(trial))

    def names(self, trial: Trial) -> tuple[str, ...]:
        """Return the causes of a set."""
        kept = [n for n in self.survey.fit.names if n not in trial.removed]
        return (*kept, *(self.survey.columns[i].name for i in trial.added))

    def promising(self, trial: Trial, barred: frozenset[str]) -> list[int]:
        """Return the atoms that one step from a set promises most of."""
        s = self.survey
        held = np.array([*trial.coefficients], dtype=int)
        x = np.array([*trial.coefficients.values()])
        start, square = self._without(trial.removed)
        slope = start + s.gram[:, :, held] @ x
        left = square + (start + slope)[:, held] @ x
        weight = self._weights(left)
        gram, b = np.tensordot(weight, s.gram, 1), weight @ slope
        inner = gram[np.ix_(held, held)] + 1e-9 * np.diag(np.diag(gram)[held] + 1e-30)
        shared = gram[np.ix_(held, self.atoms)]
        across = np.linalg.solve(inner, shared)
        b_own = b[self.atoms] - across.T @ b[held]
        size = np.diag(gram)[self.atoms] - (shared * across).sum(axis=0)
        step = np.clip(-b_own / np.maximum(size, 1e-30), 0.0, self._high[self.atoms])
        gain = -(b_own * step + 0.5 * size * step**2)
        present = {s.columns[i].name for i in trial.added} | barred
        names = self.names(trial)
        allowed = [
            (g, i) for g, i in zip(gain, self.atoms, strict=True)
            if g > 0.0 and s.columns[i].name not in present
            and self.relatives[s.columns[i].name].isdisjoint(names)
        ]  # fmt: skip
        allowed.sort(reverse=True)
        out: list[int] = []
        seen: dict[str, int] = {}
        for _, i in allowed:
            name = s.columns[i].name
            seen[name] = seen.get(name, 0) + 1
            if seen[name] <= 2:
                out.append(i)
            if len(out) >= CLOSER:
                break
        return out

    def grow(self, start: Trial, barred: Iterable[str] = (), forced: Iterable[str] = ()) -> Trial:
        """Add, remove and exchange causes as long as it pays.

        Args:
            start: Where to begin.
            barred: Effects that may not be added.
            forced: Effects that may not be removed.
        """
        barred, forced = frozenset(barred), frozenset(forced)
        best = start
        for _ in range(MOST_STEPS):
            moves = list(self._moves(best, barred, forced))
            found = min(moves, key=self.cost, default=best)
            if self.cost(found) >= self.cost(best) - 1.0e-9:
                break
            best = found
        return best

    def _moves(
        self, trial: Trial, barred: frozenset[str], forced: frozenset[str]
    ) -> Iterable[Trial]:
        smaller = list(self._removals(trial, forced))
        yield from smaller
        for base in (trial, *smaller):
            if len(self.names(base)) < self.most:
                for atom in self.promising(base, barred):
                    yield self.solve((*base.added, atom), base.removed)

    def _removals(self, trial: Trial, forced: frozenset[str]) -> Iterable[Trial]:
        for atom in trial.added:
            if self.survey.columns[atom].name not in forced:
                yield self.solve([a for a in trial.added if a != atom], trial.removed)
        for name in self.survey.fit.names:
            if name not in trial.removed and name not in forced:
                yield self.solve(trial.added, (*trial.removed, name))

    def within(self, single: Trial) -> Trial:
        """Return a set with one cause more than the fit, in the place of its relatives there.

        At the limit it stands in the place of another.
        """
        relatives = self.relatives[self.survey.columns[single.added[0]].name]
        there = [name for name in self.removals if name in relatives]
        if there:
            return self.solve(single.added, there)
        if len(self.names(single)) <= self.most:
            return single
        return min((self.solve(single.added, [n]) for n in self.removals), key=self.cost)

    def best_atoms(self) -> dict[str, Trial]:
        """Return for every effect that the fit has not the best set with it besides."""
        by_name: dict[str, Trial] = {}
        for atom in self.atoms:
            trial, name = self.solve((atom,), ()), self.survey.columns[atom].name
            if name not in by_name or trial.score < by_name[name].score:
                by_name[name] = trial
        return by_name

    def singles(self, count: int) -> list[Trial]:
        """Return the best sets of one cause more than the fit, one per effect, best first."""
        start = self.solve((), ())
        ranked = sorted(self.best_atoms().values(), key=self.cost)
        return [t for t in ranked if t.score < start.score][:count]


def choose(chooser: Chooser, sets: int) -> list[Trial]:
    """Return different sets: the best, those without each of its members, those with each rival.

    Args:
        chooser: Chooser of one survey.
        sets: How many sets to return at most.
    """
    columns = chooser.survey.columns
    start = chooser.solve((), ())
    best = chooser.grow(start)
    found = [
        best,
        *(chooser.grow(start, barred=[columns[atom].name]) for atom in best.added),
        *(chooser.grow(chooser.solve((), [name])) for name in chooser.survey.fit.names),
    ]
    for single in chooser.singles(FORCED):
        name = columns[single.added[0]].name
        if name not in chooser.names(best):
            found.append(chooser.grow(chooser.within(single), forced=[name]))
    found.sort(key=chooser.cost, reverse=True)
    different = {frozenset(chooser.names(trial)): trial for trial in found}
    different.pop(frozenset(chooser.survey.fit.names), None)
    return sorted(different.values(), key=chooser.cost)[:sets]


def exchanges(chooser: Chooser, count: int) -> list[Trial]:
    """Return for each cause of the fit the sets with the likeliest others in its place.

    Only who promises a share of what the cause is worth is among them.
    """
    out: list[Trial] = []
    columns, start = chooser.survey.columns, chooser.solve((), ())
    for name in chooser.survey.fit.names:
        others = [n for n in chooser.survey.fit.names if n != name]
        less = chooser.solve((), [name])
        bar = less.score - PROMISE * max(0.0, less.score - start.score)
        ranked: dict[str, Trial] = {}
        for atom in chooser.atoms:
            rival = columns[atom].name
            if not chooser.relatives[rival].isdisjoint(others):
                continue
            trial = chooser.solve([atom], [name])
            if rival not in ranked or trial.score < ranked[rival].score:
                ranked[rival] = trial
        best = sorted(ranked, key=lambda rival: ranked[rival].score)[:count]
        near = [rival for rival in best if ranked[rival].score < bar]
        out += [ranked[rival] for rival in near]
    return out
