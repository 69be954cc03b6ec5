"""Physics and a network together, on every bench."""

from __future__ import annotations

from dataclasses import replace

from tendon_newton.model_file import load_model, write_model
from train.reproduction.diagnosis_stage import numbers_of
from train.reproduction.hybrid import hybrid_of
from train.reproduction.outcome import Outcome
from train.reproduction.reproduction import Reproduction

TEXT = """\
The servo with friction and the network on what it lacks; all that the diagnosis names behind the
load cell; and give and slack of the tendon, read off the recordings that show tip and force."""


def run(reproduction: Reproduction) -> Outcome:
    """Put all of it together."""
    numbers = {}
    for unit in reproduction.units:
        servo = load_model(reproduction.model_file(unit, "servo"))
        model = hybrid_of(servo, reproduction.model(unit, "physical"), unit.dataset)
        write_model(reproduction.model_file(unit, "hybrid"), model)
        behind = numbers_of(replace(model, effects=model.effects[len(servo.effects) :]))
        numbers[unit.name] = {k: v for k, v in behind.items() if k != model.actuator.name}
    return Outcome(numbers=numbers, text=TEXT)
