"""Which run would tell causes apart: the one on which none can imitate another."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tendon_newton.actuators import find_actuator
from tendon_newton.data.bench_overrides import BenchOverrides
from tendon_newton.data.excitations import EXCITATIONS, excite
from tendon_newton.data.plain_numbers import quantity
from tendon_newton.data.recording import Array, Recording
from tendon_newton.diagnosis.explanation import OpenClass, Setting
from tendon_newton.diagnosis.imitation import ImitationTrial, Likeness, find_likenesses
from tendon_newton.diagnosis.search.floors import form_scales
from tendon_newton.diagnosis.search.search_worlds import SEARCH_STEP
from tendon_newton.effects import EFFECTS
from tendon_newton.errors import InvalidParameter
from tendon_newton.identification.study import Residual, Study, replacements
from tendon_newton.mechanisms.loading import load_mechanism

DURATION = 12.0
"""Length of a proposed run [s]."""
TENDON_BENCHES = ("finger", "spring_weak", "spring_strong")
"""Benches on which a run may be proposed for a servo with a tendon; a direct drive stays put."""
OTHER_MASSES = (0.5, 2.0)
"""Factors on the mass of a direct drive: with one load, gravity and what load does look alike."""
SEEDS = (7, 8, 9)
"""Each draws another run of the same excitation."""
EQUAL_SHARE = 0.01
"""Losses closer than this share of what a cause removes count as equal [1]."""
ERRORS = 2.0
"""Standard deviations of noise within which losses count as equal [1]."""
MARGIN = 3.0
"""What a diagnosis needs to tell causes apart, and so many times more, counts as enough."""
NO_RUN = "no run of the library does"
"""Beginning of the proposal where no run tells the causes apart."""
MOST_REPEATS = 20
"""More repeats of a run than this are no plan."""


@dataclass(frozen=True, kw_only=True)
class Plan:
    """Command to record, and the bench for it."""

    setting: Setting
    excitation: str
    time: Array
    """[s], shape (T,)."""
    command: Array
    """Of the servo that moves [rad], shape (T,)."""
    servo: int = 0
    """The servo that moves; the others hold at 0."""
    servos: int = 1
    """Servos D of the bench."""

    @property
    def commands(self) -> Array:
        """Commands of all servos [rad], shape (T, D)."""
        out = np.zeros((len(self.command), self.servos))
        out[:, self.servo] = self.command
        return out

    @property
    def place(self) -> str:
        """Bench, with its load where that is told, and the servo that moves, of several."""
        moving = f", servo {self.servo} moving" if self.servos > 1 else ""
        return f"{bench_text(self.setting)}{moving}"

    @property
    def duration(self) -> float:
        """Length [s], to the end of the last row."""
        return round(float(2.0 * self.time[-1] - self.time[-2]), 6)


@dataclass(frozen=True, kw_only=True)
class Contrast:
    """Difference of two causes in a run."""

    likeness: Likeness
    repeats: int | None
    """Runs like this that a diagnosis needs to tell them apart; None where no number suffices."""


@dataclass(frozen=True, kw_only=True)
class Prediction:
    """Differences of all causes of a class in a run."""

    plan: Plan
    contrasts: tuple[Contrast, ...]
    """Contrasts of each two causes."""
    force_unit: str = "N"

    @property
    def open(self) -> tuple[tuple[str, str], ...]:
        """Pairs that it leaves open, however often it is repeated."""
        return tuple(c.likeness.pair for c in self.contrasts if c.repeats is None)

    @property
    def repeats(self) -> int | None:
        """Runs that settle all that a run like this can settle; None where that is nothing."""
        return max((c.repeats for c in self.contrasts if c.repeats is not None), default=None)

    @property
    def hardest(self) -> Likeness:
        """The two causes that are least apart, of those that it can tell apart at all."""
        settled = [c.likeness for c in self.contrasts if c.repeats is not None]
        chosen = settled or [c.likeness for c in self.contrasts]
        return min(chosen, key=lambda likeness: likeness.behind)

    def text(self) -> str:
        """Return the proposal in words, without a full stop."""
        like, plan = self.hardest, self.plan
        force = "" if like.force is None else f" and {quantity(like.force, self.force_unit)}"
        times = {None: "", 1: ""}.get(self.repeats, f", {self.repeats} times")
        sentence = (
            f"record {plan.duration:.0f} s of {plan.excitation.replace('_', ' ')} on bench "
            f"{plan.place}{times}: there {' and '.join(like.pair)} differ by "
            f"{quantity(like.theta, 'rad')}{force} RMS, however they are fitted"
        )
        if self.repeats is None:
            return f"{NO_RUN}; the best is to {sentence}"
        left = "; ".join(f"{a} from {b}" for a, b in self.open)
        return f"{sentence} (no run of the library tells {left})" if left else sentence


def propose(
    question: OpenClass,
    *,
    benches: Sequence[str] | None = None,
    seeds: Sequence[int] = SEEDS[:1],
    duration: float = DURATION,
) -> tuple[Prediction, ...]:
    """Simulate every explanation on every bench and excitation, and rank them, best first.

    An imitator may be refitted to the run (to first order, within what the data at hand leave
    open), so only what it cannot imitate counts.

    Args:
        question: The causes, and the data that could not tell them apart.
        benches: Benches that may be used; by default those at hand, and for a servo with a tendon
            the others that there are assets for.
        seeds: Runs drawn of each excitation; the best one stands for it.
        duration: Length of each run [s].
    """
    if find_actuator(question.without.actuator.name).leads:
        raise InvalidParameter(
            "runs are designed as commands of a servo, and here a shaft is led along a path: lead "
            "it more slowly and under other loads, and diagnose that with the recordings at hand"
        )
    plans = library_plans(settings_to_try(question.settings, benches), seeds, duration)
    predictions = predict(question, play(question, plans))
    own = {setting.bench for setting in question.settings}
    ranked: dict[tuple[str, str], Prediction] = {}
    for p in sorted(predictions, key=lambda p: rank(p, own)):
        ranked.setdefault((p.plan.place, p.plan.excitation), p)
    return tuple(ranked.values())


@dataclass(frozen=True, kw_only=True)
class Played:
    """Planned runs as the model without a cause, and each explanation of the data, would run."""

    plans: tuple[Plan, ...]
    trials: tuple[ImitationTrial, ...]
    residuals: tuple[Residual, ...]
    """Residuals of each run: less what is simulated by the model without a cause, then by the
    models of each trial."""


def library_plans(settings: Sequence[Setting], seeds: Sequence[int], duration: float) -> list[Plan]:
    """Draw runs of every excitation of the library on every bench: each servo moves in turn."""
    return [
        plan_run(setting, name, seed, duration, servo, servos)
        for setting, servo, servos in servos_of(settings)
        for name in EXCITATIONS
        for seed in seeds
    ]


def servos_of(settings: Sequence[Setting]) -> list[tuple[Setting, int, int]]:
    """Return each bench with each of its servos, and how many they are."""
    counts = [len(load_mechanism(setting.bench).tendons) for setting in settings]
    return [(s, servo, n) for s, n in zip(settings, counts, strict=True) for servo in range(n)]


def play(question: OpenClass, plans: Sequence[Plan]) -> Played:
    """Simulate planned runs with every explanation of the data."""
    has_force = question.noise.force is not None
    runs = [blank_recording(plan, has_force) for plan in plans]
    study = Study(
        runs, question.without, tuple(EFFECTS), time_step=SEARCH_STEP, scale=question.scale
    )
    trials = [ImitationTrial(study, explanation) for explanation in question.explanations]
    models = [{}, *(model for trial in trials for model in trial.models)]
    return Played(
        plans=tuple(plans),
        trials=tuple(trials),
        residuals=tuple(by_run(study, models)),
    )


def by_run(study: Study, models: Sequence[Mapping[int, float]]) -> list[Residual]:
    """Simulate models and return the residuals of each run, those of its servos side by side."""
    found, count = study.residuals(*replacements(models)), study.servos
    if count == 1:
        return found
    out: list[Residual] = []
    for first in range(0, len(found), count):
        own = found[first : first + count]
        forces = [r.force for r in own if r.force is not None]
        out.append(
            Residual(
                theta=np.concatenate([r.theta for r in own], axis=1),
                force=np.concatenate(forces, axis=1) if forces else None,
                trusted=np.concatenate([r.trusted for r in own]),
            )
        )
    return out


def predict(question: OpenClass, played: Played) -> tuple[Prediction, ...]:
    """Return what every run is expected to show of every two causes."""
    form = form_scales(question.scale)
    seen = [
        (plan, find_likenesses(residual, played.trials, question.noise, form))
        for plan, residual in zip(played.plans, played.residuals, strict=True)
    ]
    recorded = gain_recorded(question.settings, seen)
    return tuple(
        Prediction(
            plan=plan,
            contrasts=tuple(
                Contrast(likeness=like, repeats=repeats_needed(like, recorded)) for like in likes
            ),
            force_unit=question.scale.force_unit,
        )
        for plan, likes in seen
    )


def rank(prediction: Prediction, own: set[str]) -> tuple[int, float, bool, float]:
    """Order runs: most settled, fewest repeats, a bench at hand, the greatest separation."""
    away = prediction.plan.setting.bench not in own
    repeats = prediction.repeats or math.inf
    return (len(prediction.open), repeats, away, -prediction.hardest.separation)


def settings_to_try(
    recorded: Sequence[Setting], benches: Sequence[str] | None
) -> tuple[Setting, ...]:
    """Return benches as they were set up, and others on which the same servo can be tried."""
    own = {setting.bench: replace(setting, seconds=0.0) for setting in recorded}
    found = [replace(setting, seconds=0.0) for setting in recorded]
    if set(own) <= set(TENDON_BENCHES):
        found += [Setting(bench=name) for name in TENDON_BENCHES if name not in own]
    else:
        found += [heavier for setting in recorded for heavier in other_masses(setting)]
    if benches is None:
        return tuple(found)
    new = [Setting(bench=name) for name in benches if name not in {s.bench for s in found}]
    return (*(setting for setting in found if setting.bench in benches), *new)


def other_masses(setting: Setting) -> list[Setting]:
    """Return a bench with other loads, where the data say how heavy its own is."""
    mass = setting.bench_overrides.mass
    if mass is None:
        return []
    return [
        replace(
            setting,
            seconds=0.0,
            bench_overrides=BenchOverrides(
                **{**setting.bench_overrides.given, "mass": tuple(factor * m for m in mass)}
            ),
        )
        for factor in OTHER_MASSES
    ]


def bench_text(setting: Setting) -> str:
    """Name a bench, with its load where that is told."""
    mass = setting.bench_overrides.mass
    load = "" if mass is None else f" with {' and '.join(f'{m:.3g}' for m in mass)} kg"
    return f"{setting.bench}{load}"


def plan_run(
    setting: Setting, excitation: str, seed: int, duration: float, servo: int = 0, servos: int = 1
) -> Plan:
    """Draw one run of an excitation; its command stays inside the servo's range."""
    time, command = excite(excitation, duration, np.random.default_rng(seed))
    return Plan(
        setting=setting, excitation=excitation, time=time, command=command,
        servo=servo, servos=servos,
    )  # fmt: skip


def blank_recording(plan: Plan, has_force: bool) -> Recording:
    """Return a recording that has commands and, in place of measurements, zeros."""
    blank = np.zeros((len(plan.time), plan.servos))
    return Recording(
        name=plan.excitation,
        bench=plan.setting.bench,
        time=plan.time,
        command=plan.commands,
        motor_position=blank,
        motor_velocity=blank,
        force=blank if has_force else None,
        bench_overrides=plan.setting.bench_overrides,
        actuator_overrides=plan.setting.actuator_overrides,
    )


def gain_recorded(
    recorded: Sequence[Setting], seen: Sequence[tuple[Plan, Sequence[Likeness]]]
) -> float:
    """Return about what the cause removes of the loss of the data at hand.

    A second of them counts as a second of the planned runs on the same bench.
    """
    total = 0.0
    for setting in recorded:
        same = [entry for entry in seen if entry[0].setting.same_bench(setting)] or seen
        rates = [like.gain / plan.duration for plan, likes in same for like in likes]
        total += setting.seconds * float(np.mean(rates)) if rates else 0.0
    return total


def repeats_needed(like: Likeness, recorded: float) -> int | None:
    """Return how many runs tell two causes apart beyond what a diagnosis asks.

    With n runs the imitation is n times the loss behind. The n-fold loss must exceed a share of the
    loss that the cause removes of all data. The loss must also exceed the scatter, which grows with
    the root of n.
    """
    share = MARGIN * EQUAL_SHARE
    if like.behind <= share * like.gain or like.behind == 0.0:
        return None
    by_share = share * recorded / (like.behind - share * like.gain)
    by_scatter = (MARGIN * ERRORS * like.scatter / like.behind) ** 2
    count = max(1, math.ceil(max(by_share, by_scatter)))
    return count if count <= MOST_REPEATS else None
