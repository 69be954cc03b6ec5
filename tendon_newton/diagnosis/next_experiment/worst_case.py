"""How hard a run may pull under any model that the data allow: no run passes the limit there.

Models are drawn, since many numbers may be off together, and one is driven to where the run pulls
hardest, since few draws come near that corner.
"""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tendon_newton.data.recording import Array
from tendon_newton.diagnosis.next_experiment.expected_run import Expected, ranked
from tendon_newton.diagnosis.next_experiment.open_sets import OpenSets, moved_sets
from tendon_newton.diagnosis.next_experiment.planned_runs import Plan, by_run

LOOKED_AT, TOGETHER = 8, 1
"""Runs of a bench that are simulated together while commands are varied, and at the end."""
FEW_DRAWS, DRAWS = 10, 128  # Models drawn from the intervals for each of these runs
STEP = 5.0e-4  # Simulation step [s]: peaks of force are shorter than a step of the search
WIDER = 2.0  # How much wider than the intervals models are drawn [1]
CORNER = 3.5
"""How far the model that pulls hardest is from the middle [standard deviations of the draws]: one
draw in four thousand is further in its direction."""


@dataclass(frozen=True, kw_only=True)
class Designs:
    """Runs that a search has tried."""

    runs: tuple[Expected, ...]  # Runs that stay within the limit, best first
    refused: tuple[float, ...]  # Largest tensions of the others [N]


class WorstCase:
    """The largest tension of runs under models that the data allow, of every set of causes.

    Args:
        question: What is open.
        rng: Draws models.
    """

    def __init__(self, question: OpenSets, rng: np.random.Generator) -> None:
        self._question, self._rng = question, rng

    def roughly(self, found: Sequence[Expected]) -> list[Expected]:
        """Return runs with their largest tension under few drawn models [N]."""
        return self._with_peaks(found, lambda runs: self.drawn(runs, FEW_DRAWS))

    def thoroughly(self, found: Sequence[Expected]) -> list[Expected]:
        """Return runs with their largest tension under many models and at the corner [N]."""
        return self._with_peaks(
            found, lambda runs: np.maximum(self.drawn(runs, DRAWS), self.at_corner(runs))
        )

    def drawn(self, plans: Sequence[Plan], draws: int) -> Array:
        """Return the largest tension of each run under models drawn anew [N], shape (P,).

        Args:
            plans: The runs.
            draws: Models of all sets together; an unlikely set may pull as hard as the likeliest.
        """
        sets = self._question.posterior.sets
        each = math.ceil(draws / len(sets))
        normals = [self._rng.normal(size=(each, len(own.numbers))) for own in sets]
        return self._peaks(plans, normals).max(axis=1)

    def at_corner(self, plans: Sequence[Plan]) -> Array:
        """Return each run's tension where it grows most in the likeliest set, to first order [N].

        Shape (P,).
        """
        likeliest, *others = self._question.posterior.sets
        count, none = len(likeliest.numbers), [np.zeros((0, len(o.numbers))) for o in others]
        if not count:
            return np.zeros(len(plans))
        ways = np.concatenate([np.eye(count), -np.eye(count)])
        up, down = np.split(self._peaks(plans, [ways, *none]), 2, axis=1)
        slopes = up - down
        sizes = np.linalg.norm(slopes, axis=1, keepdims=True)
        corners = CORNER * slopes / np.where(sizes > 0.0, sizes, 1.0)
        far = np.diag(self._peaks(plans, [corners, *none]))
        return np.maximum(far, np.maximum(up, down).max(axis=1))

    def _with_peaks(
        self, found: Sequence[Expected], look: Callable[[Sequence[Plan]], Array]
    ) -> list[Expected]:
        """Return runs with a largest tension; without a load cell as they are."""
        if self._question.noise.force is None or not found:
            return list(found)
        peaks = look([e.plan for e in found])
        return [
            replace(e, peak_force=max(float(peak), e.peak_force or 0.0))
            for e, peak in zip(found, peaks, strict=True)
        ]

    def _peaks(self, plans: Sequence[Plan], normals: Sequence[Array]) -> Array:
        """Return the largest tension of runs under models [N], shape (P, N).

        Args:
            plans: The runs.
            normals: Places of each set's models, in standard deviations of the draws, (N, F) each.
        """
        study = self._question.study(plans, STEP)
        sets = moved_sets(self._question, study)
        models = [m for own, z in zip(sets, normals, strict=True) for m in own.drawn(WIDER * z)]
        residuals = by_run(study, models)
        return np.array([np.max(-r.force, axis=1) for r in residuals if r.force is not None])


def roughly_within_limit(
    found: Sequence[Expected], worst: WorstCase, force_limit: float
) -> tuple[Expected, ...]:
    """Return runs to vary, best first: of each bench the best that few models keep calm."""
    kept: list[Expected] = []
    for own in by_bench(e for e in found if is_calm(e, force_limit)):
        for begin in range(0, len(own), LOOKED_AT):
            looked = worst.roughly(own[begin : begin + LOOKED_AT])
            if calm := [e for e in looked if is_calm(e, force_limit)]:
                kept += calm
                break
    return ranked(kept)


def within_limit(found: Sequence[Expected], worst: WorstCase, force_limit: float) -> Designs:
    """Return the best runs of each bench that stay below a tension in the worst case.

    Runs are looked at in the order of their worth, few at a time, until one stays below it. Runs
    that were not looked at are not returned.
    """
    kept: list[Expected] = []
    refused = [e for e in found if not is_calm(e, force_limit)]
    for own in by_bench(e for e in found if is_calm(e, force_limit)):
        for begin in range(0, len(own), TOGETHER):
            looked = worst.thoroughly(own[begin : begin + TOGETHER])
            good = [e for e in looked if is_calm(e, force_limit)]
            refused += [e for e in looked if not is_calm(e, force_limit)]
            kept += good
            if good:
                break
    return Designs(
        runs=ranked(kept), refused=tuple(e.peak_force for e in refused if e.peak_force is not None)
    )


def by_bench(found: Iterable[Expected]) -> list[list[Expected]]:
    """Return runs of each bench, in their order."""
    benches: dict[str, list[Expected]] = {}
    for expected in found:
        benches.setdefault(expected.plan.setting.bench, []).append(expected)
    return list(benches.values())


def is_calm(expected: Expected, force_limit: float) -> bool:
    """Tell whether a run stays below a tension [N], as far as that is known."""
    return expected.peak_force is None or expected.peak_force < force_limit
