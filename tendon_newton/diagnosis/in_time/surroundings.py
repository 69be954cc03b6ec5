"""All numbers around one set of changes between two days, and what the recordings say of each."""

from collections.abc import Collection, Mapping, Sequence

import numpy as np

from tendon_newton.data.recording import Array
from tendon_newton.diagnosis.search.coordinates import is_shape
from tendon_newton.diagnosis.search.floors import Floors
from tendon_newton.diagnosis.search.refit import Fit, linearise, rows_of, start_fits, values_of
from tendon_newton.diagnosis.search.search_worlds import SearchWorlds
from tendon_newton.identification.intervals import SHARED_FORM, half_widths, rows_together
from tendon_newton.identification.linearisation import Linearisation, invertible
from tendon_newton.identification.objective import Layout
from tendon_newton.identification.study import Study


class Surroundings:
    """All numbers around one set of changes, those of the first day uncertain with them.

    Args:
        first: Recordings of the first day; None where a diagnosis is all that is left of them.
        floors: Least scale of each signal.
        names: Causes whose numbers may have moved.
        fit: The set, fitted to the second day.
        spread: Numbers of the first day, column -> standard deviation [coordinate]; zero of what is
            certain.
    """

    def __init__(
        self,
        first: SearchWorlds | None,
        second: SearchWorlds,
        floors: Floors,
        names: Sequence[str],
        fit: Fit,
        spread: Mapping[int, float],
    ) -> None:
        self.second, self.moved = second, frozenset(fit.names)
        known = [c for c, own in spread.items() if own > 0.0]
        self.walking = [c for name in names for c in strengths(second.study, name)]
        there = values_of(second, fit.columns, fit.place)
        columns = (*known, *self.walking)
        residual, slopes, place = linearised(second, names, floors, there, columns)
        self.known, self.where, self.place = len(known), second.where, place[len(known) :]
        if first is not None:
            before, old, _ = linearised(first, names, floors, {}, known)
            old = np.concatenate([old, np.zeros((len(before), len(self.walking)))], axis=1)
            residual, slopes = np.concatenate([residual, before]), np.concatenate([slopes, old])
            self.where = joined(self.where, first.where)
        self.point = Linearisation(residual=residual, jacobian=slopes)
        self.spread = np.array([*(spread[c] for c in known), *(np.inf for _ in self.walking)])
        self.together = rows_together(self.point, self.where)

    def places(self, names: Collection[str]) -> list[int]:
        """Return the places of the first day's numbers and of the changes of some causes."""
        own = {c for name in names for c in strengths(self.second.study, name)}
        walking = [self.known + k for k, c in enumerate(self.walking) if c in own]
        return [*range(self.known), *walking]

    def step(self, names: Collection[str]) -> tuple[Array, float]:
        """Return where numbers go once some causes may move, and what that gains [nat]."""
        free = self.places(names)
        hessian = self.point.normal_matrix()[np.ix_(free, free)]
        hessian = hessian + np.diag(self.together / self.spread[free] ** 2)
        slope = -self.point.gradient()[free]
        step = np.linalg.solve(invertible(hessian), slope).astype(np.float64)
        return step, float(0.5 * slope @ step) / self.together / SHARED_FORM**2

    def gain(self, name: str) -> float:
        """Return what another change promises to gain [nat]."""
        step, gain = self.step(self.moved | {name})
        (column, *_), place = strengths(self.second.study, name), self.places(self.moved | {name})
        k = self.walking.index(column)
        own = self.second.coordinate(column)
        to = self.place[k] + step[place.index(self.known + k)]
        return gain - self.step(self.moved)[1] if own.lower <= to <= own.upper else 0.0

    def estimates(self, name: str) -> dict[int, tuple[float, float, float]]:
        """Return a cause's numbers on the second day: column -> value and 95 % interval [unit]."""
        names = self.moved | {name}
        free = self.places(names)
        step, _ = self.step(names)
        part = Linearisation(residual=self.point.residual, jacobian=self.point.jacobian[:, free])
        half = half_widths(part, self.where, self.spread[free])
        out = {}
        for column in strengths(self.second.study, name):
            k = self.walking.index(column)
            at, own = free.index(self.known + k), self.second.coordinate(column)
            place = self.place[k] + (0.0 if name in self.moved else step[at])
            ends = np.clip([place, place - half[at], place + half[at]], own.lower, own.upper)
            value, low, high = (own.value(float(u)) for u in ends)
            out[column] = value, min(low, high), max(low, high)
        return out

    def holds_before(self, name: str) -> bool:
        """Tell whether the intervals of a cause hold that nothing moved."""
        found = self.estimates(name).items()
        return all(low <= self.second.study.base_value(c) <= high for c, (_, low, high) in found)


def linearised(
    worlds: SearchWorlds,
    names: Sequence[str],
    floors: Floors,
    there: Mapping[int, float],
    columns: Sequence[int],
) -> tuple[Array, Array, Array]:
    """Linearise a day's residuals, in units of what the model leaves.

    Returns:
        Residual, shape (M,); its derivatives by the columns' coordinates, shape (M, F), a column
        that stands twice having two; and those coordinates, shape (F,).
    """
    once = tuple(dict.fromkeys(columns))
    values = {c: there.get(c, worlds.study.base_value(c)) for c in once}
    (fit,) = start_fits(worlds, [(tuple(names), values)], floors, near=True)
    unit = rows_of(worlds, fit, floors).size
    (jacobian,) = linearise(worlds, [fit])
    order = [once.index(c) for c in columns]
    return fit.residual / unit, (jacobian / unit[:, None])[:, order], fit.place[order]


def joined(one: Layout, other: Layout) -> Layout:
    """Return the layout of two days' residuals, one after the other."""
    return Layout(
        recording=np.concatenate([one.recording, other.recording + one.recording.max() + 1]),
        block=np.concatenate([one.block, other.block + one.block_count]),
        signal=np.concatenate([one.signal, other.signal]),
        part=np.concatenate([one.part, other.part]),
        block_count=one.block_count + other.block_count,
    )


def strengths(study: Study, name: str) -> tuple[int, ...]:
    """Return the columns of a cause's strengths."""
    own = study.table.columns(name)
    return own if len(own) == 1 else tuple(c for c in own if not is_shape(study.parameter(c)))
