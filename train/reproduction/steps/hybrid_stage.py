"""Physics and a network together, on every bench."""

from __future__ import annotations

from dataclasses import replace

from tendon_newton.data.model_file import load_model, write_model
from train.reproduction.hybrid import hybrid_of
from train.reproduction.outcome import Outcome
from train.reproduction.reproduction import Reproduction
from train.reproduction.steps.diagnosis_stage import numbers_of

TEXT = """\
The servo with friction and the network on what it lacks; all that the diagnosis names behind the
load cell; and give and slack of the tendon, read off the recordings that show tip and force."""


def run(reproduction: Reproduction) -> Outcome:
    """Put all of it together."""
    units = reproduction.units
    found = reproduction.each(joined, range(len(units)))
    numbers = {unit.name: own for unit, own in zip(units, found, strict=True)}
    return Outcome(numbers=numbers, text=TEXT)


def joined(reproduction: Reproduction, place: int) -> dict[str, dict[str, float | str]]:
    """Write the model of both of one bench and return what it has behind the load cell."""
    unit = reproduction.units[place]
    servo = load_model(reproduction.model_file(unit, "servo"))
    model = hybrid_of(servo, reproduction.model(unit, "physical"), unit.dataset)
    write_model(reproduction.model_file(unit, "hybrid"), model)
    behind = numbers_of(replace(model, effects=model.effects[len(servo.effects) :]))
    return {name: own for name, own in behind.items() if name != model.actuator.name}
