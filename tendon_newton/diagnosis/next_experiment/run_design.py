"""Which run tells the most about what a diagnosis left open: commands are improved, not picked."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from tendon_newton.data.excitations import DESIGNED, RATE
from tendon_newton.diagnosis.explanation import Setting
from tendon_newton.diagnosis.next_experiment.designed_command import DesignedCommand
from tendon_newton.diagnosis.next_experiment.expected_run import Forecast, ranked
from tendon_newton.diagnosis.next_experiment.open_sets import OpenSets
from tendon_newton.diagnosis.next_experiment.planned_runs import (
    Plan,
    library_plans,
    plan_run,
    servos_of,
)
from tendon_newton.diagnosis.next_experiment.worst_case import (
    Designs,
    WorstCase,
    roughly_within_limit,
    within_limit,
)

DRAWN = 5  # Commands drawn for each servo of each bench at the start
REACHES = (1.0, 0.5, 0.25)
"""Shares of the servo's range that drawn commands use, in turn [1]. Where little is known, some
model pulls too hard under most commands, and the gentle ones are left."""
KEPT = 3  # Best commands of a round, which the next round varies
VARIED = 3  # Variants of each of them
ROUNDS = ((0.4, 0.3), (0.25, 0.15))
"""Share of the numbers that move, and by how much, in each round of variants [1]."""
SEED, TASK_SEED = 7, 8
"""Seeds of the library's runs, and of what is to be predicted unless the user says it."""
DURATION = 12.0  # Length of a proposed run [s]
LITTLE = 0.1  # A run that is expected to tell less tells nothing [bit]
NO_RUN = "no run of the library does"
"""Beginning of the proposal where no run tells the causes apart."""


@dataclass(frozen=True, kw_only=True)
class DesignedPlan(Plan):
    """A run whose command can be varied."""

    shape: DesignedCommand


def design(
    forecast: Forecast,
    settings: Sequence[Setting],
    rng: np.random.Generator,
    *,
    duration: float,
    force_limit: float,
    progress: Callable[[str], None] = lambda _: None,
) -> Designs:
    """Search the commands that tell the most, and return the runs that were tried.

    The search starts from the library's excitations and drawn commands, on each bench, and varies
    the best of them that stay below the limit. Runs that may pull harder are left out.

    Args:
        forecast: What is open, and which run a model shall predict.
        settings: Benches that may be used.
        rng: Draws commands and models.
        duration: Length of a run [s].
        force_limit: Tension that no run may reach under any model drawn [N].
        progress: Told what is being done.
    """
    plans = library_plans(settings, (SEED,), duration)
    drawn = [
        designed(own, DesignedCommand.draw(rng, REACHES[k % len(REACHES)]), duration)
        for own in servos_of(settings)
        for k in range(DRAWN)
    ]
    progress(f"simulating {len(plans) + len(drawn)} runs on {len(settings)} benches")
    found = forecast.runs([*plans, *drawn])
    worst = WorstCase(forecast.question, rng)
    for share, size in ROUNDS:
        calm = [e.plan for e in roughly_within_limit(found, worst, force_limit)]
        best = [plan for plan in calm if isinstance(plan, DesignedPlan)][:KEPT]
        variants = [
            designed((p.setting, p.servo, p.servos), p.shape.moved(rng, share, size), duration)
            for p in best
            for _ in range(VARIED)
        ]
        progress(f"varying the best {len(best)} commands")
        found = ranked([*found, *forecast.runs(variants)])
    return within_limit(found, worst, force_limit)


def usual_task(setting: Setting, duration: float) -> Plan:
    """Return the run that a model shall predict: steps to random angles."""
    _, servo, servos = servos_of([setting])[-1]
    return plan_run(setting, "random_steps", TASK_SEED, duration, servo, servos)


def designed(
    where: tuple[Setting, int, int], shape: DesignedCommand, duration: float
) -> DesignedPlan:
    """Return the run of a command.

    Args:
        where: The bench, the servo that moves, and how many there are.
        shape: The command.
        duration: Length [s].
    """
    time, (setting, servo, servos) = np.arange(round(duration * RATE)) / RATE, where
    return DesignedPlan(
        setting=setting, excitation=DESIGNED, time=time, command=shape.at(time), shape=shape,
        servo=servo, servos=servos,
    )  # fmt: skip


def separating_run(
    question: OpenSets,
    settings: Sequence[Setting],
    names: Sequence[str],
    *,
    duration: float = DURATION,
) -> str:
    """Say which run tells causes apart, without a full stop.

    Every set is simulated on every bench with every excitation. A set may refit its numbers within
    what the data leave open, so that only what it cannot imitate counts.

    Args:
        question: The sets, equally likely, one for each cause.
        settings: Benches that may be used.
        names: The causes.
        duration: Length of the run [s].
    """
    forecast = Forecast(question, usual_task(settings[0], duration))
    found = forecast.runs(library_plans(settings, (SEED,), duration))
    best = max(found, key=lambda expected: expected.told.names)
    run = f"{duration:.0f} s of {best.plan.excitation.replace('_', ' ')} on bench {best.plan.place}"
    bits = f"of {forecast.entropy:.1f} bits that tell {' from '.join(names)}, {best.told.names:.1f}"
    if best.told.names < LITTLE:
        return f"{NO_RUN}: {bits} are expected of the best, {run}; a further sensor may"
    return f"record {run}: {bits} are expected"
