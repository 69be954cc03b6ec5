"""All sets of causes that were fitted, and the best of them."""

import logging
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from tendon_newton.data.recording import Array
from tendon_newton.diagnosis.search.floors import (
    floors_of,
    form_of,
    is_dry,
)
from tendon_newton.diagnosis.search.refit import Fit, refit, rescored, surprise, values_of
from tendon_newton.diagnosis.search.rule import CHANGED, NATS, SEARCHED
from tendon_newton.diagnosis.search.search_worlds import QUIET, Floors, SearchWorlds
from tendon_newton.diagnosis.search.unseen_parts import unseen_terms
from tendon_newton.effects import are_related, law_of
from tendon_newton.identification.signals import SIGNALS, Scales

FOLLOWED = (12, 6, 3)
"""Sets that are followed ever further, after one look and after each two steps of their refit."""
RENEWED = 4  # Steps of a refit at other floors: what they hid was not fitted
LOG = logging.getLogger(__name__)


@dataclass
class Pool:
    """All sets that were fitted on one study, the best place of each."""

    worlds: SearchWorlds
    floors: Floors  # Least scale of each signal; all scores are at these
    dearest: float  # Most that each number of a cause must bring, see `price` [nat per row]
    most: int  # Causes that are looked for at once
    followed: Sequence[int] = FOLLOWED  # Sets that are followed, see `FOLLOWED`
    price_share: float = 1.0  # Share of the price that is asked while the search is on [1]
    until: float = np.inf
    """Instant of the monotonic clock after which nothing further is looked for [s]."""
    fits: dict[frozenset[str], Fit] = field(default_factory=dict)
    pruned: dict[frozenset[str], frozenset[str]] = field(default_factory=dict)
    """What is left of sets of which causes that do not pay were dropped, as they stand."""
    singles: dict[str, tuple[float, dict[str, float]]] = field(default_factory=dict)
    """Share of the gap that each effect explains alone as a survey sees it, and its numbers."""
    added: dict[str, float] = field(default_factory=dict)
    """Score that each effect would add to the last set that was looked around [nat per row]."""
    unseen: dict[tuple[frozenset[str], float], Array] = field(default_factory=dict)
    """Rows' shares of the score of parts that no number has seen, by a set's causes and score."""

    alone: float = 1.0
    """Rows that err alone and tell as much as all do under the likeliest set so far [1]."""

    @property
    def price(self) -> float:
        """Gain in score that each number of a cause must bring [nat per row]."""
        return min(self.dearest, NATS / self.alone)

    @property
    def is_late(self) -> bool:
        """Whether the time is over."""
        return time.monotonic() > self.until

    def unseen_terms(self, fit: Fit, until: float = np.inf) -> Array | None:
        """Return each row's share of the score where a fit did not see it, shape (M,).

        Refits that leave out each part are made once. None where the time did not suffice.
        """
        key = frozenset(fit.names), fit.score
        if key not in self.unseen:
            found = unseen_terms(self.worlds, fit, self.floors, until)
            if found is None:
                return None
            self.unseen[key] = found
        return self.unseen[key]

    def add(self, fits: Sequence[Fit]) -> None:
        """Keep fits that are better than those of the same causes; no law beside its own case."""
        for fit in fits:
            key = frozenset(fit.names)
            if any(are_related(one, other) for one in key for other in key):
                continue
            if key not in self.fits or fit.score < self.fits[key].score:
                # no slopes, soon those of another place, and no residuals simulated beside its own
                self.fits[key] = replace(fit, slopes={}, residual=fit.residual.copy())
                self.pruned.pop(key, None)
        if self.fits:
            likeliest = min(self.fits.values(), key=lambda f: f.score)
            self.alone = self.worlds.rows_alone(likeliest.residual, self.floors)

    def rescore(self, fit: Fit, values: Mapping[int, float]) -> bool:
        """Score all sets at the floors of one, and where it says that the step can be trusted.

        Args:
            fit: Its causes give the floors.
            values: Its numbers, column -> value.

        Returns:
            Whether scores changed.
        """
        floors = floors_of(self.worlds, fit.names)
        if not self.worlds.look_finer(values, floors) and floors == self.floors:
            return False
        self.floors = floors
        self.pruned.clear()
        self.unseen.clear()
        if self.fits:
            new = rescored(self.worlds, list(self.fits.values()), floors)
            self.fits = dict(zip(self.fits, new, strict=True))
        return True

    def renew(self, fit: Fit) -> Fit:
        """Score all sets as one asks, and follow that one there; return it."""
        if self.rescore(fit, values_of(self.worlds, fit.columns, fit.place)):
            own = self.fits[frozenset(fit.names)]
            self.add(refit(self.worlds, [own], self.floors, iterations=RENEWED, coarse=0))
        return self.fits[frozenset(fit.names)]

    def bar(self, name: str) -> float:
        """Return the gain in score that a cause must bring: each of its numbers has a price."""
        return self.price * len(law_of(name).parameters)

    def change(self, fit: Fit, less: Fit) -> float:
        """Return how much smaller residuals a fit has than another [errors of form of the other].

        All rows count by their weight, those of a jump too: a cause may act at times only.
        """
        form = form_of(self.worlds, less.names, CHANGED)
        return self._largest(self._rise(less.residual**2, fit.residual**2, self.floors), form)

    def mean_excess(self, fit: Fit, floors: Floors, share: float) -> float:
        """Return how much larger residuals a fit has than the floors [its errors of form].

        A cause that acts in few rows is seen here, and hardly in the score, whose tails are heavy.
        A mean of n squares scatters by a share of the root of 2 / n, and so does the noise that n
        rows told: twice what both scatter together is chance.
        """
        where, weight = self.worlds.where, self.worlds.weights(floors)
        floor = where.sizes(floors) ** 2
        for _, rows in where.signals:
            count = weight[rows].sum() ** 2 / np.square(weight[rows]).sum()
            floor[rows] *= 1.0 + 2.0 * np.sqrt(4.0 / count)
        form = form_of(self.worlds, fit.names, share)
        return self._largest(self._rise(fit.residual**2, floor, floors), form)

    def _rise(self, more: Array, less: Array, floors: Floors) -> list[tuple[str, float]]:
        """Return the root of the mean by which squares are larger, signal by signal [its unit].

        A signal stands there once for each servo.
        """
        weight, out = self.worlds.weights(floors), list[tuple[str, float]]()
        gain = weight * (more - less)
        for signal, rows in self.worlds.where.signals:
            mean = float(gain[rows].sum() / weight[rows].sum())
            out.append((signal, float(np.sqrt(max(0.0, mean)))))
        return out

    @staticmethod
    def _largest(rise: Sequence[tuple[str, float]], form: Scales) -> float:
        return max(value / form.of(signal) for signal, value in rise)

    def leaves_nothing(self, fit: Fit, *, anywhere: bool = False, usual: bool = False) -> bool:
        """Tell whether a fit leaves nothing to explain.

        Residuals are as likely as normal ones at the floors, and no larger in the mean than by
        what a cause must change. Where something sticks the mean says nothing as a rule, since what
        holds in some rest may be far off.

        Args:
            fit: The fit.
            anywhere: Whether the mean counts where something sticks, too.
            usual: Whether all that laws usually miss counts as nothing.
        """
        floors = floors_of(self.worlds, fit.names, usual=usual)
        (judged,) = rescored(self.worlds, [fit], floors)
        if self.excess(judged) >= self.dearest:
            return False
        if not anywhere and is_dry((*self.worlds.study.known, *fit.names)):
            return True
        return self.mean_excess(judged, floors, 1.0 if usual else SEARCHED) < 1.0

    def gain(self, fit: Fit, less: Fit) -> float:
        """Return by how much a fit is more likely than another [nat per row]."""
        return less.score + self.surprise(less) - fit.score - self.surprise(fit)

    def surprise(self, fit: Fit) -> float:
        """Return how unlikely a fit is beside what is stated of its numbers [nat per row]."""
        return surprise(self.worlds, fit) / self.alone

    def worth(self, fit: Fit, less: Fit, name: str) -> float:
        """Return what a cause is worth in units of what is asked [1]; below one it is dropped.

        Without a cause that is a stated number out of its tolerance residuals need not change.
        """
        gain = self.gain(fit, less) / self.bar(name)
        return gain if self.is_stated(name) else min(gain, self.change(fit, less))

    def is_stated(self, name: str) -> bool:
        """Tell whether all numbers of a cause are stated: it is their being out of tolerance."""
        return self.worlds.stated.issuperset(self.worlds.study.table.columns(name))

    def cost(self, fit: Fit) -> float:
        """Return a fit's score, its causes and surprises paid for [nat per row]."""
        return fit.score + self.surprise(fit) + self.price_share * self.price * self.numbers(fit)

    def numbers(self, fit: Fit) -> int:
        """Count the numbers of a fit's causes: of those that a law may leave out, what it has."""
        places = dict(zip(fit.columns, fit.place, strict=True))
        columns = self.worlds.study.table.columns
        laws = [(name, law_of(name).parameters) for name in fit.names]
        absent = sum(
            p.optional and bool(places.get(c) == 0.0)
            for name, own in laws
            for c, p in zip(columns(name), own, strict=False)
        )
        return sum(len(own) for _, own in laws) - absent

    def best(self) -> Fit:
        """Return the best fit, its causes paid for."""
        return min(self.fits.values(), key=self.cost)

    def excess(self, fit: Fit) -> float:
        """Return what a fit leaves above normal residuals at the floors [nat per row].

        Rows at which something acts at times count in their tails.
        """
        return fit.score - QUIET * len(self.worlds.where.signals)

    def log(self, text: str, *fits: Fit) -> None:
        """Tell whoever debugs a search a text with fits in the places of its `%s`."""
        if LOG.isEnabledFor(logging.DEBUG):
            LOG.debug(text, *map(self.describe, fits))

    def describe(self, fit: Fit) -> str:
        """Say a fit in one line."""
        owners = self.worlds.study.table.owners
        numbers = " ".join(
            f"{owners[c][0]}.{owners[c][1].name}={v:.4g}"
            for c, v in values_of(self.worlds, fit.columns, fit.place).items()
        )
        scales = ", ".join(
            f"{signal} {scale:.3g} {SIGNALS[signal].unit}"
            for (signal, _), scale in zip(self.worlds.where.signals, fit.scales, strict=True)
        )
        return f"{fit.score:.3f} {scales}: {numbers or 'nothing'}"
