"""Physics and a network together, on every bench."""

from collections.abc import Sequence
from dataclasses import replace

from tendon_lab.reproduction.outcome import Outcome
from tendon_lab.reproduction.reproduction import Reproduction
from tendon_lab.reproduction.steps.diagnosis_stage import numbers_of
from tendon_newton.data.dataset import Dataset
from tendon_newton.data.model_file import Model, load_model, write_model
from tendon_newton.data.recording import Recording
from tendon_newton.effects import find_effect
from tendon_train.tendon.taut_rows import shows_string
from tendon_train.tendon.tendon_fit import fit_tendon

TEXT = """\
The servo with friction and the network on what it lacks; all that the diagnosis names behind the
load cell; and give and slack of the tendon, read off the recordings that show tip and force."""


async def run(reproduction: Reproduction) -> Outcome:
    """Put all of it together."""
    units = reproduction.units
    found = await reproduction.each(joined, range(len(units)))
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


def hybrid_of(corrected: Model, physical: Model, dataset: Dataset) -> Model:
    """Return a corrected servo with a diagnosed mechanism and a measured tendon.

    The physical model keeps all that it has behind the load cell. Where recordings show the tip
    and the force, give and slack of the tendon are read off them, and take the place of what a
    fit in a closed loop made of them.

    Args:
        corrected: As `train_correction` makes it.
        physical: The diagnosed model.
        dataset: Recordings to learn from.
    """
    behind = tuple(e for e in physical.effects if find_effect(e.name).side != "actuator")
    effects = (*corrected.effects, *behind)
    model = replace(physical, actuator=corrected.actuator, effects=effects, fit=())
    return fit_tendon(dataset, model)[1] if show_tendon(dataset.train) else model


def show_tendon(recordings: Sequence[Recording]) -> bool:
    """Tell whether recordings of exactly one finger show the tip while a load cell pulls."""
    return len({r.bench for r in recordings if shows_string(r)}) == 1
