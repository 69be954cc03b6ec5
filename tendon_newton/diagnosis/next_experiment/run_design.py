"""Which run tells the most about what a diagnosis left open: commands are improved, not picked."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tendon_newton.data.excitations import DESIGNED, RATE
from tendon_newton.data.recording import Array, Recording
from tendon_newton.diagnosis.explanation import OpenClass, Setting
from tendon_newton.diagnosis.imitation import Trial
from tendon_newton.diagnosis.next_experiment.designed_command import DesignedCommand
from tendon_newton.diagnosis.next_experiment.separation import (
    STEP,
    Plan,
    Played,
    Prediction,
    blank_recording,
    library_plans,
    play,
    predict,
)
from tendon_newton.diagnosis.search.floors import form_scales
from tendon_newton.effects import EFFECTS
from tendon_newton.identification.study import Residual, Study, replacements

DRAWN = 8
"""Commands drawn for each bench at the start."""
REACHES = (1.0, 0.5, 0.25)
"""Shares of the servo's range that drawn commands use, in turn [1]. Where little is known, some
model pulls too hard under most commands, and the gentle ones are left."""
KEPT = 4
"""Best commands of a round, which the next round varies."""
VARIED = 4
"""Variants of each of them."""
ROUNDS = ((0.4, 0.3), (0.25, 0.15))
"""Share of the numbers that move, and by how much, in each round of variants [1]."""
SEED = 7
"""Of the library's runs."""
LOOKED_AT = 8
"""Runs of a bench that are simulated together under drawn models."""
DRAWS = 16
"""Models drawn from the intervals, under each of which a run must stay within its limit."""
RIVAL_WORTH = 100.0
"""Bits that a pair of causes told apart is worth: classes come before widths of intervals."""


@dataclass(frozen=True, kw_only=True)
class DesignedPlan(Plan):
    """A run whose command can be varied."""

    shape: DesignedCommand


@dataclass(frozen=True, kw_only=True)
class Expected:
    """What a run is expected to bring."""

    prediction: Prediction
    """How far it keeps the causes of the class apart."""
    numbers: Mapping[str, float]
    """Information about each number of the model, as ``owner.name`` [bit]: log2 of what its
    interval shrinks by."""
    peak_force: float | None
    """Largest tension under any model tried [N]; None without a load cell."""

    @property
    def bits(self) -> float:
        """Information about all numbers [bit]."""
        return sum(self.numbers.values())

    @property
    def settles(self) -> float:
        """Pairs of causes that it tells apart; a run of several that it takes counts its share."""
        return sum(1.0 / c.repeats for c in self.prediction.contrasts if c.repeats is not None)

    @property
    def worth(self) -> float:
        """What runs are compared by [bit]."""
        return RIVAL_WORTH * self.settles + self.bits


@dataclass(frozen=True, kw_only=True)
class Designs:
    """Runs that a search has tried."""

    runs: tuple[Expected, ...]
    """Those that stay within the limit, best first."""
    refused: tuple[float, ...]
    """Largest tensions of the others [N]."""


def design(
    question: OpenClass,
    known: Sequence[Plan],
    settings: Sequence[Setting],
    rng: np.random.Generator,
    *,
    duration: float,
    force_limit: float,
    row_worth: float | None = None,
    progress: Callable[[str], None] = lambda _: None,
) -> Designs:
    """Search the commands that tell the most, and return the runs that were tried.

    The search starts from the library's excitations and drawn commands, on each bench, and varies
    the best of them that stay below the limit. Runs that may pull harder are left out.

    Args:
        question: Explanations of the data, all their numbers with intervals.
        known: Runs at hand: what they tell already is no news.
        settings: Benches that may be used.
        rng: Draws commands and models.
        duration: Length of a run [s].
        force_limit: Tension that no run may reach under any model drawn [N].
        row_worth: Independent witnesses per row; by default as many as make the runs at hand
            give the question's intervals [1].
        progress: Told what is being done.
    """
    plans = library_plans(settings, (SEED,), duration)
    drawn = [
        designed(s, DesignedCommand.draw(rng, REACHES[k % len(REACHES)]), duration)
        for s in settings
        for k in range(DRAWN)
    ]
    progress(f"simulating {len(plans) + len(drawn)} runs on {len(settings)} benches")
    found = expect(question, [*plans, *drawn], known, row_worth)
    worst = WorstCase(question, rng)
    for share, size in ROUNDS:
        calm = [e.prediction.plan for e in within_limit(found, worst, force_limit).runs]
        best = [plan for plan in calm if isinstance(plan, DesignedPlan)][:KEPT]
        variants = [
            designed(plan.setting, plan.shape.moved(rng, share, size), duration)
            for plan in best
            for _ in range(VARIED)
        ]
        progress(f"varying the best {len(best)} commands")
        found = ranked([*found, *expect(question, variants, known, row_worth)])
    return within_limit(found, worst, force_limit)


def designed(setting: Setting, shape: DesignedCommand, duration: float) -> DesignedPlan:
    """Return the run of a command."""
    time = np.arange(round(duration * RATE)) / RATE
    return DesignedPlan(
        setting=setting, excitation=DESIGNED, time=time, command=shape.at(time), shape=shape
    )


def plan_of(recording: Recording) -> Plan:
    """Return a recorded run as if it were still to be made."""
    if recording.command is None:
        raise ValueError(f"{recording.name}: a run to be made again has commands")
    return Plan(
        setting=Setting(
            bench=recording.bench,
            bench_overrides=recording.bench_overrides,
            actuator_overrides=dict(recording.actuator_overrides),
        ),
        excitation=recording.name,
        time=recording.time,
        command=recording.command[:, 0],
    )


def expect(
    question: OpenClass,
    plans: Sequence[Plan],
    known: Sequence[Plan],
    row_worth: float | None = None,
) -> tuple[Expected, ...]:
    """Return what runs are expected to bring, best first.

    Args:
        question: Explanations of the data.
        plans: The runs.
        known: Runs of the data at hand.
        row_worth: As of `design`.
    """
    if not plans:
        return ()
    played = play(question, [*known, *plans])
    predictions = predict(question, played)[len(known) :]
    matrices = [information(question, played, i) for i in range(len(played.plans))]
    recorded = sum(matrices[: len(known)], np.zeros(matrices[0].shape))
    posterior = Posterior(played.trials[0], recorded, row_worth)
    return ranked(
        Expected(prediction=p, numbers=posterior.bits(m), peak_force=peak(r))
        for p, m, r in zip(
            predictions, matrices[len(known) :], played.residuals[len(known) :], strict=True
        )
    )


def ranked(found: Iterable[Expected]) -> tuple[Expected, ...]:
    """Return runs, those that bring the most first."""
    return tuple(sorted(found, key=lambda expected: -expected.worth))


def information(question: OpenClass, played: Played, index: int) -> Array:
    """Return what a run says of the numbers of the first explanation, shape (F, F).

    Residuals count in units of what noise and errors of form leave, as in a fit.
    """
    form, noise = form_scales(question.scale), question.noise
    residual, trial = played.residuals[index], played.trials[0]
    own = slice(1, 1 + len(trial.models))
    parts = [residual.theta[own] / max(form.theta, noise.theta)]
    if residual.force is not None and noise.force is not None:
        parts.append(residual.force[own] / max(form.force, noise.force))
    signals = np.concatenate(parts, axis=1)
    jacobian = (signals[1:] - signals[0]).T / trial.steps
    return jacobian.T @ jacobian


class Posterior:
    """What the data at hand leave open of a model's numbers, and what a run would leave.

    Rows are no independent witnesses: errors of form last. So the information of all rows is scaled
    until it agrees with the intervals of the diagnosis, and that of a new run likewise.

    Args:
        trial: The numbers, their spreads and ranges.
        recorded: Information of the data at hand, shape (F, F).
        row_worth: Independent witnesses per row in place of that [1].
    """

    def __init__(self, trial: Trial, recorded: Array, row_worth: float | None = None) -> None:
        self._prior = np.diag((trial.upper - trial.lower) ** -2.0)
        self._recorded, self._names = recorded, trial.names
        if row_worth is None:
            spread = np.sqrt(np.diag(np.linalg.inv(recorded + self._prior)))
            row_worth = float(np.exp(2.0 * np.mean(np.log(spread / trial.spreads))))
        self._row_worth = row_worth

    def spreads(self, new: Array | float) -> Array:
        """Return standard deviations with further information, shape (F,)."""
        total = self._row_worth * (self._recorded + new) + self._prior
        return np.sqrt(np.diag(np.linalg.inv(total)))

    def bits(self, new: Array) -> dict[str, float]:
        """Return by how much each number is known better with a run [bit]."""
        shrinks = np.log2(self.spreads(0.0) / self.spreads(new))
        return dict(zip(self._names, shrinks.tolist(), strict=True))


def peak(residual: Residual) -> float | None:
    """Return the largest tension of a run under all models [N]."""
    return None if residual.force is None else float(np.max(-residual.force))


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
