"""How hard a run may pull under any model that the data allow: no run passes the limit there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tendon_newton.diagnosis.explanation import OpenClass
from tendon_newton.diagnosis.imitation import Trial
from tendon_newton.diagnosis.next_experiment.expected_run import Expected, ranked
from tendon_newton.diagnosis.next_experiment.separation import STEP, Plan, blank_recording
from tendon_newton.effects import EFFECTS
from tendon_newton.identification.study import Study, replacements

LOOKED_AT = 8
"""Runs of a bench that are simulated together under drawn models."""
DRAWS = 64
"""Models drawn from the intervals, under each of which a run must stay within its limit."""


@dataclass(frozen=True, kw_only=True)
class Designs:
    """Runs that a search has tried."""

    runs: tuple[Expected, ...]
    """Those that stay within the limit, best first."""
    refused: tuple[float, ...]
    """Largest tensions of the others [N]."""


class WorstCase:
    """The largest tension of runs under models drawn from the intervals, each run simulated once.

    Args:
        question: Its first explanation has the numbers.
        rng: Draws models.
    """

    def __init__(self, question: OpenClass, rng: np.random.Generator) -> None:
        self._question, self._rng = question, rng
        self._known: dict[tuple[str, bytes], float] = {}

    def looked_at(self, found: Sequence[Expected]) -> list[Expected]:
        """Return runs with their largest tension [N]; without a load cell as they are."""
        if self._question.noise.force is None:
            return list(found)
        plans = [e.prediction.plan for e in found]
        keys = [(plan.setting.bench, plan.command.tobytes()) for plan in plans]
        new = [plan for plan, k in zip(plans, keys, strict=True) if k not in self._known]
        if new:
            peaks = worst_forces(self._question, new, self._rng)
            self._known |= dict(zip([k for k in keys if k not in self._known], peaks, strict=True))
        return [replace(e, peak_force=self._known[k]) for e, k in zip(found, keys, strict=True)]


def within_limit(found: Sequence[Expected], worst: WorstCase, force_limit: float) -> Designs:
    """Return the runs that stay below a tension in the worst case.

    Of each bench the best are looked at, so many at a time, until some of them stay below it. Runs
    that were not looked at are not returned.
    """
    kept: list[Expected] = []
    refused = [e for e in found if not is_calm(e, force_limit)]
    calm = [e for e in found if is_calm(e, force_limit)]
    for bench in dict.fromkeys(e.prediction.plan.setting.bench for e in calm):
        own = [e for e in calm if e.prediction.plan.setting.bench == bench]
        for begin in range(0, len(own), LOOKED_AT):
            looked = worst.looked_at(own[begin : begin + LOOKED_AT])
            good = [e for e in looked if is_calm(e, force_limit)]
            refused += [e for e in looked if not is_calm(e, force_limit)]
            kept += good
            if good:
                break
    return Designs(
        runs=ranked(kept),
        refused=tuple(e.peak_force for e in refused if e.peak_force is not None),
    )


def is_calm(expected: Expected, force_limit: float) -> bool:
    """Tell whether a run stays below a tension [N], as far as that is known."""
    return expected.peak_force is None or expected.peak_force < force_limit


def worst_forces(
    question: OpenClass, plans: Sequence[Plan], rng: np.random.Generator, draws: int = DRAWS
) -> list[float]:
    """Return the largest tension of runs under models drawn from the intervals, twice as wide [N].

    Args:
        question: Its first explanation has the numbers.
        plans: The runs.
        rng: Draws models.
        draws: Models.
    """
    runs = [blank_recording(plan, has_force=True) for plan in plans]
    study = Study(runs, question.without, tuple(EFFECTS), time_step=STEP, scale=question.scale)
    trial = Trial(study, question.explanations[0])
    centre = np.array(list(trial.models[0].values()))
    moves = np.clip(
        rng.normal(size=(draws, len(centre))) * 2.0 * trial.spreads, trial.lower, trial.upper
    )
    models = [dict(zip(trial.models[0], centre + move, strict=True)) for move in moves]
    residuals = study.residuals(*replacements(models))
    return [float(np.max(-r.force)) for r in residuals if r.force is not None]
