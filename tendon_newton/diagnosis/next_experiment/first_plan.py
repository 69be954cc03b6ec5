"""Runs to record before there are any data: what they will tell about a model's numbers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from tendon_newton.actuators import find_actuator
from tendon_newton.data.model_file import Model
from tendon_newton.data.parameters import BenchScale, Parameter
from tendon_newton.diagnosis.explanation import Estimate, Explanation, OpenClass, Setting
from tendon_newton.diagnosis.next_experiment.run_design import Expected, design
from tendon_newton.effects import find_effect
from tendon_newton.errors import InvalidModelFile
from tendon_newton.identification.noise_floor import NoiseFloor

NOISE = NoiseFloor(theta=2.0 * np.pi / 4096.0 / np.sqrt(12.0), force=0.05)
"""Of a servo's encoder with 4096 counts a turn, and of a load cell of 5 kg [rad, N]."""
LITTLE = 0.5
"""A run that is expected to bring less is not worth its time [bit]."""
ROW_WORTH = 1.0 / 80.0
"""Independent witnesses per row [1]: what a simple law misses lasts for about a second."""
TOLD = 2.0
"""A number whose interval is this many bits narrower than its range can be told from the data."""


@dataclass(frozen=True, kw_only=True)
class FirstPlan:
    """Runs in the order in which they are worth recording, and what they tell together."""

    steps: tuple[Expected, ...]
    bits: dict[str, float]
    """Of each number, as ``owner.name``: log2 of its range over the interval that is expected."""

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
    progress: Callable[[str], None] = lambda _: None,
) -> FirstPlan:
    """Design one run after the other, each for what the runs before it leave open.

    Args:
        model: Its effects' numbers, and those that it lists under ``fit``, are to be told.
        settings: Benches that may be used.
        runs: Runs at most.
        duration: Length of a run [s].
        force_limit: Tension that no run may reach [N].
        rng: Draws commands.
        progress: Told what is being done.

    Raises:
        InvalidModelFile: The model has no number to be told.
    """
    question = prior_question(model, settings)
    steps: list[Expected] = []
    bits = dict.fromkeys(
        (f"{o}.{n}" for o, own in question.explanations[0].numbers.items() for n in own), 0.0
    )
    for number in range(runs):
        progress(f"run {number + 1} of {runs}")
        found = design(
            question,
            [step.prediction.plan for step in steps],
            settings,
            rng,
            duration=duration,
            force_limit=force_limit,
            row_worth=ROW_WORTH,
            progress=progress,
        )
        if not found or found[0].bits < LITTLE:
            break
        steps.append(found[0])
        for name, more in found[0].numbers.items():
            bits[name] += more
    return FirstPlan(steps=tuple(steps), bits=bits)


def prior_question(model: Model, settings: Sequence[Setting]) -> OpenClass:
    """Return a model as the only explanation, each number as open as its range."""
    parameters = find_actuator(model.actuator.name).parameters
    fitted = {
        p.name: anywhere(p, float(model.actuator.values.get(p.name, p.nominal)))
        for p in parameters
        if p.name in model.fit
    }
    numbers = {model.actuator.name: fitted}
    for effect in model.effects:
        numbers[effect.name] = {
            p.name: anywhere(p, float(effect.values.get(p.name, p.null)))
            for p in find_effect(effect.name).parameters
        }
    if not any(numbers.values()):
        raise InvalidModelFile(
            "a plan is for a model with effects, or numbers under fit; this one has neither: add "
            "the effects that you suspect, with values that you think likely"
        )
    return OpenClass(
        explanations=(Explanation(cause="model", numbers=numbers),),
        without=model,
        settings=tuple(settings),
        noise=NOISE,
        scale=BenchScale(),
    )


def anywhere(parameter: Parameter, value: float) -> Estimate:
    """Return a number of which only the range is known."""
    return Estimate(value=value, ci95=(parameter.lower, parameter.upper), unit=parameter.unit)
