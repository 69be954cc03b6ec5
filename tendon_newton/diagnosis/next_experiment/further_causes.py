"""Causes that no set holds: whether they may act still, and what a run tells of that.

A search follows few sets, and the truth may be beside them. Each further cause is a question of
its own: does it act beside the likeliest set, at a typical size, whatever the set's numbers are?
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tendon_newton.data.recording import Array
from tendon_newton.diagnosis.search.coordinates import atoms
from tendon_newton.identification.study import Study
from tendon_newton.identification.testable import testable_effects

ACTING = 0.1
"""Share of the causes of the catalogue that act on a bench, before there are data [1]: some
four."""


@dataclass(frozen=True, kw_only=True)
class Seen:
    """What rows tell of the numbers of the likeliest set, and of further causes [witnesses]."""

    numbers: Array  # Products of the changes by the numbers, shape (F, F)
    along: Array  # Products of the changes by the numbers and by the causes, shape (F, E)
    causes: Array  # Squared changes by the causes, shape (E,)

    def __add__(self, other: Seen) -> Seen:
        """Return what the rows of both tell."""
        return Seen(
            numbers=self.numbers + other.numbers,
            along=self.along + other.along,
            causes=self.causes + other.causes,
        )

    def __rmul__(self, worth: float) -> Seen:
        """Return what is told where each row counts that much [1]."""
        return Seen(
            numbers=worth * self.numbers, along=worth * self.along, causes=worth * self.causes
        )

    def apart(self, loose: Array) -> Array:
        """Return how far each cause is from none, squared, shape (E,): the numbers may make up.

        Args:
            loose: Covariance of the numbers without these rows, shape (F, F).
        """
        held = np.linalg.solve(np.eye(len(loose)) + loose @ self.numbers, loose)
        return np.maximum(0.0, self.causes - (self.along * (held @ self.along)).sum(axis=0))


def further_causes(study: Study, causes: tuple[str, ...]) -> dict[str, dict[int, float]]:
    """Return the causes that a set lacks, each at the least size that is typical, column -> value.

    A cause with a place is left out: nobody knows where to look for it.

    Args:
        study: Runs that show a cause, or do not.
        causes: Causes of the set.
    """
    return {
        name: atoms(study, name)[0]
        for name in testable_effects(study)
        if name not in causes
        and not any(study.parameter(c).name == "position" for c in study.table.columns(name))
    }


def chances(apart: Array) -> Array:
    """Return how likely causes act of which rows have shown nothing [1], shape (E,).

    Args:
        apart: How far each would be from none in these rows, squared, shape (E,).
    """
    odds = ACTING / (1.0 - ACTING) * np.exp(-0.5 * apart)
    return odds / (1.0 + odds)


def entropy(chance: Array) -> Array:
    """Return how open it is whether each cause acts [bit], shape (E,)."""
    chance = np.maximum(chance, np.finfo(float).tiny)
    return -chance * np.log2(chance) - (1.0 - chance) * np.log2(1.0 - chance)


def told_of(chance: Array, apart: Array) -> Array:
    """Return what rows are expected to tell of whether causes act [bit], shape (E,).

    Args:
        chance: That each acts [1], shape (E,).
        apart: By how much further from none the rows put each, squared, shape (E,).
    """
    overlap = np.exp(-apart / 8.0)
    acts = chance * np.log2(np.maximum(chance + (1.0 - chance) * overlap, np.finfo(float).tiny))
    return -acts - (1.0 - chance) * np.log2(1.0 - chance + chance * overlap)
