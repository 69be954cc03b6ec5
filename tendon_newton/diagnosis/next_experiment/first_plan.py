"""Runs to record before there are any data: what they will tell about a model's numbers."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from tendon_newton.actuators import find_actuator
from tendon_newton.data.model_file import Model
from tendon_newton.data.parameters import BenchScale, Parameter
from tendon_newton.diagnosis.explanation import Setting
from tendon_newton.diagnosis.next_experiment.expected_run import Expected, Forecast
from tendon_newton.diagnosis.next_experiment.open_sets import OpenSets
from tendon_newton.diagnosis.next_experiment.planned_runs import Plan, blank_recording, plan_run
from tendon_newton.diagnosis.next_experiment.run_design import design, usual_task
from tendon_newton.diagnosis.next_experiment.worst_case import Designs
from tendon_newton.diagnosis.posterior import Coordinate, FittedSet, OpenNumber, Posterior
from tendon_newton.effects import find_effect
from tendon_newton.errors import InvalidModelFile
from tendon_newton.identification.bench_scale import scale_of
from tendon_newton.identification.noise_floor import NoiseFloor
from tendon_newton.simulation.hosts.replay import bench_of

ANGLE_NOISE = 2.0 * np.pi / 4096.0 / np.sqrt(12.0)
"""Noise of a servo's encoder with 4096 counts a turn [rad]."""
FORCE_NOISE = 0.05
"""Noise of a load cell of 5 kg on a nominal bench [N]; another bench has a cell of its size."""
LITTLE = 0.1  # A run that is expected to bring less is not worth its time [bit]
NOTHING = 1.0e3
"""Spread of a number of which nothing is known, as a multiple of its range [1]: the range alone
bounds it."""
ROW_WORTH = 1.0 / 80.0
"""Independent witnesses per row [1]: what a simple law misses lasts for about a second."""
TOLD = 2.0
"""A number whose interval is this many bits narrower than its range can be told from the data."""


@dataclass(frozen=True, kw_only=True)
class FirstPlan:
    """Runs in the order in which they are worth recording, and what they tell together."""

    steps: tuple[Expected, ...]
    bits: dict[str, float]
    """Bits of each number, ``owner.name``: log2 of its range over the interval expected."""
    ended: str = ""  # Why there are fewer runs than the time allows, without a full stop

    @property
    def untold(self) -> tuple[str, ...]:
        """Numbers that no run of the plan tells."""
        return tuple(name for name, bits in self.bits.items() if bits < TOLD)


def plan_first(
    model: Model,
    settings: Sequence[Setting],
    *,
    runs: int,
    duration: float,
    force_limit: float,
    rng: np.random.Generator,
    task: Plan | None = None,
    progress: Callable[[str], None] = lambda _: None,
) -> FirstPlan:
    """Design one run after the other, each for what the runs before it leave open.

    Args:
        model: Model whose effects' numbers, and those under ``fit``, are to be told.
        settings: Benches that may be used.
        runs: Runs at most.
        duration: Length of a run [s].
        force_limit: Tension that no run may reach [N].
        rng: Draws commands.
        task: The run whose prediction matters; random steps on the first bench by default.
        progress: Told what is being done.

    Raises:
        InvalidModelFile: The model has no number to be told.
    """
    question = prior_question(model, settings, duration)
    task = task or usual_task(settings[0], duration)
    ended = ""
    steps: list[Expected] = []
    (prior,) = question.posterior.sets
    bits = {f"{number.owner}.{number.name}": 0.0 for number in prior.numbers}
    for number in range(runs):
        progress(f"run {number + 1} of {runs}")
        forecast = Forecast(question, [step.plan for step in steps], task, ROW_WORTH)
        found = design(
            forecast, settings, rng, duration=duration, force_limit=force_limit, progress=progress
        )
        if not found.runs or found.runs[0].told.worth < LITTLE:
            ended = reason(found, number, force_limit, question.scale.force_unit)
            break
        best = found.runs[0]
        steps.append(best)
        for name, more in best.told.numbers.items():
            bits[name] += more
    return FirstPlan(steps=tuple(steps), bits=bits, ended=ended)


def reason(found: Designs, number: int, force_limit: float, unit: str) -> str:
    """Say why no further run is planned, and what would change that.

    Args:
        found: Runs that were tried.
        number: Runs that are planned already.
        force_limit: Tension that no run may reach [N].
        unit: Unit of a force on these benches.
    """
    words = "no run" if number == 0 else "no further run"
    away = ""
    if found.refused:
        away = (
            f"{len(found.refused)} were left out because they may reach the limit of "
            f"{force_limit:g} {unit}, the calmest with {min(found.refused):.3g} {unit}; give "
            "another --force-limit if the bench takes more, or an actuator that gives less"
        )
    if not found.runs:
        return f"{words} stays within the limit: {away}"
    best = found.runs[0].told.worth
    told = f"{words} is expected to tell {LITTLE:g} bit; the best tells {best:.2g}"
    return f"{told}. {away[0].upper()}{away[1:]}" if away else told


def prior_question(model: Model, settings: Sequence[Setting], duration: float) -> OpenSets:
    """Return a model as the only set, each number as open as its range on the benches."""
    scale = planned_scale(model, settings, duration)
    numbers = [
        anywhere(model.actuator.name, p, float(model.actuator.values.get(p.name, p.nominal)))
        for parameter in find_actuator(model.actuator.name).parameters
        if (p := parameter.on(scale)).name in model.fit
    ]
    numbers += [
        anywhere(effect.cause, p, float(effect.values.get(p.name, p.null)))
        for effect in model.effects
        for parameter in find_effect(effect.name).parameters
        if (p := parameter.on(scale))
    ]
    if not numbers:
        raise InvalidModelFile(
            "a plan is for a model with effects, or numbers under fit; this one has neither: add "
            "the effects that you suspect, with values that you think likely"
        )
    widths = np.array([n.coordinate.upper - n.coordinate.lower for n in numbers])
    own = FittedSet(
        weight=1.0,
        causes=tuple(effect.cause for effect in model.effects),
        numbers=tuple(numbers),
        covariance=np.diag(np.square(NOTHING * widths)),
    )
    return OpenSets(
        posterior=Posterior(sets=(own,)),
        model=model,
        noise=NoiseFloor(theta=float(ANGLE_NOISE), force=FORCE_NOISE * scale.force),
        scale=scale,
    )


def planned_scale(model: Model, settings: Sequence[Setting], duration: float) -> BenchScale:
    """Return how large benches are, by what commands over the servo's range ask of the actuator."""
    runs = [
        blank_recording(plan_run(setting, "stairs", 0, duration), has_force=False)
        for setting in settings
    ]
    return scale_of([bench_of(setting.bench, model) for setting in settings], runs, model)


def anywhere(owner: str, parameter: Parameter, value: float) -> OpenNumber:
    """Return a number of which only the range is known."""
    low, high = parameter.lower, parameter.upper
    scale = Coordinate(kind="linear", origin=0.0, unit=1.0, lower=low, upper=high)
    place = float(np.clip(value, low, high))
    return OpenNumber(owner=owner, name=parameter.name, coordinate=scale, place=place)
