"""Sets of causes that data leave open, as models to simulate on runs that are only planned."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from tendon_newton.data.model_file import Model
from tendon_newton.data.parameters import BenchScale
from tendon_newton.data.recording import Array
from tendon_newton.diagnosis.next_experiment.planned_runs import Plan, blank_recording, by_run
from tendon_newton.diagnosis.posterior import FittedSet, Posterior
from tendon_newton.diagnosis.search.floors import form_scales
from tendon_newton.diagnosis.search.search_worlds import SEARCH_STEP
from tendon_newton.effects import EFFECTS
from tendon_newton.identification.noise_floor import NoiseFloor
from tendon_newton.identification.study import Study

MOST_SETS = 3
"""Likeliest sets of causes for which runs are designed: each number takes a simulation."""
STRIDE = 0.001
"""Step of a difference, as a share of a coordinate and of a typical size besides [1]. Over longer
ones what bends looks like another direction, and would seem to tell sets apart."""


@dataclass(frozen=True, kw_only=True)
class OpenSets:
    """What is not known of a bench, and what its sensors see."""

    posterior: Posterior
    model: Model  # The model that the sets start from
    noise: NoiseFloor
    scale: BenchScale = field(default_factory=BenchScale)  # How large the benches are

    @property
    def weights(self) -> Array:
        """Weights of the sets, which are one together [1], shape (K,)."""
        own = np.array([one.weight for one in self.posterior.sets])
        return own / own.sum()

    def study(self, plans: Sequence[Plan], step: float = SEARCH_STEP) -> Study:
        """Return planned runs, ready to be simulated.

        Args:
            plans: The runs.
            step: Step of the simulation [s].
        """
        runs = [blank_recording(plan, self.noise.force is not None) for plan in plans]
        return Study(runs, self.model, tuple(EFFECTS), time_step=step, scale=self.scale)


def likeliest(posterior: Posterior) -> Posterior:
    """Return the sets for which runs are designed."""
    return Posterior(sets=posterior.sets[:MOST_SETS])


class MovedSet:
    """A set at its optimum, and with each of its numbers moved, as models to simulate.

    A number of a bench alone is left out: other benches have their own.

    Args:
        study: The planned runs.
        own: The set.
    """

    def __init__(self, study: Study, own: FittedSet) -> None:
        places = {(owner, p.name): c for c, (owner, p) in enumerate(study.table.owners)}
        seen = [i for i, n in enumerate(own.numbers) if (n.owner, n.name) in places]
        self.names = tuple(f"{own.numbers[i].owner}.{own.numbers[i].name}" for i in seen)
        self.covariance = own.within_ranges[np.ix_(seen, seen)]
        self.coordinates = [own.numbers[i].coordinate for i in seen]
        self._columns = [places[own.numbers[i].owner, own.numbers[i].name] for i in seen]
        self._seen, self._own = seen, own
        self.place = place = np.array([own.numbers[i].place for i in seen])
        steps = STRIDE * (1.0 + np.abs(place))
        over = place + steps > [c.upper for c in self.coordinates]
        self.steps = np.where(over, -steps, steps)
        self.models = [self._model(place), *map(self._model, place + np.diag(self.steps))]

    def drawn(self, normal: Array) -> list[dict[int, float]]:
        """Return models drawn from the set, column -> value.

        Args:
            normal: Standard normal numbers, shape (N, F).
        """
        values = self._own.at(normal)[:, self._seen]
        return [dict(zip(self._columns, row, strict=True)) for row in values.tolist()]

    def _model(self, place: Array) -> dict[int, float]:
        values = [c.value(float(u)) for c, u in zip(self.coordinates, place, strict=True)]
        return dict(zip(self._columns, values, strict=True))


@dataclass(frozen=True, kw_only=True)
class PlayedSets:
    """A planned run under all sets, its rows reduced to what a forecast needs."""

    means: Array  # Products of what the sets predict, shape (K, K)
    slopes: tuple[tuple[Array, ...], ...]
    """Products of the changes by the numbers of two sets, shape (F, F') each."""
    mixed: tuple[Array, ...]
    """Products of the changes by a set's numbers with what the sets predict, shape (F, K) each."""
    rows: int  # Rows of all signals
    peak_force: float | None = None  # Largest tension under the sets [N]; None without a load cell


def moved_sets(question: OpenSets, study: Study) -> tuple[MovedSet, ...]:
    """Return the models of all sets."""
    return tuple(MovedSet(study, own) for own in question.posterior.sets)


def play(question: OpenSets, plans: Sequence[Plan]) -> tuple[PlayedSets, ...]:
    """Simulate planned runs under every set.

    Signals count in units of what noise and errors of form leave, as in a fit.
    """
    if not plans:
        return ()
    study, noise, form = question.study(plans), question.noise, form_scales(question.scale)
    sets = moved_sets(question, study)
    models = [m for own in sets for m in own.models]
    out: list[PlayedSets] = []
    for r in by_run(study, models):
        parts, peak = [-r.theta / max(form.theta, noise.theta)], None
        if r.force is not None and noise.force is not None:
            parts.append(-r.force / max(form.force, noise.force))
            peak = float(np.max(-r.force))
        played = reduced(sets, np.concatenate(parts, axis=1))
        out.append(replace(played, peak_force=peak))
    return tuple(out)


def reduced(sets: Sequence[MovedSet], signals: Array) -> PlayedSets:
    """Return the products of signals, shape (N, M), of all sets' models."""
    ends = np.cumsum([0, *(len(own.models) for own in sets)])
    means = np.stack([signals[i] for i in ends[:-1]])
    slopes = [
        (signals[i + 1 : j] - signals[i]) / own.steps[:, None]
        for own, (i, j) in zip(sets, pairwise(ends.tolist()), strict=True)
    ]
    return PlayedSets(
        means=means @ means.T,
        slopes=tuple(tuple(one @ other.T for other in slopes) for one in slopes),
        mixed=tuple(one @ means.T for one in slopes),
        rows=signals.shape[1],
    )
