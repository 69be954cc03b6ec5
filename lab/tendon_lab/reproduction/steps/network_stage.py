"""Force networks of every bench, or of a part of its recordings, trained and written as models."""

from dataclasses import asdict
from pathlib import Path
from typing import Any, Literal

from tendon_lab.reproduction.outcome import Outcome
from tendon_lab.reproduction.physical import SPOOL_RADIUS
from tendon_lab.reproduction.reproduction import Reproduction
from tendon_lab.reproduction.unit import Unit
from tendon_lab.reproduction.unit_correction import train_correction
from tendon_newton.data.model_file import Model, NamedValues, write_model
from tendon_train.actuator.fitting.run import train_to_file
from tendon_train.actuator.training_config import Kind, Purpose

Aim = Literal["prediction", "simulation", "correction"]
"""What a network is for: the force along measured motion, in the loop of a simulation, or what a
servo with friction lacks there."""
IN_LOOP: Purpose = "simulation"
TEXT = """\
The first kind is trained three times on every bench: along measured motion, for the loop of a
simulation, and on what a servo with friction, four numbers fitted along the measured motion, leaves
of the measured force. That is nothing where the force lies between what sliding in and sliding out
would give and the motor stands still. In a simulation what this one adds is held between its
queries; stiffness, back-EMF and friction act at every step."""


async def run(reproduction: Reproduction) -> Outcome:
    """Train what is missing: every kind on the first bench, one kind on the others."""
    kinds = reproduction.settings.kinds
    aims: tuple[Aim, ...] = ("prediction", "simulation", "correction")
    items = [
        (place, kind, aim)
        for place in range(len(reproduction.units))
        for kind in kinds[: None if place == 0 else 1]
        for aim in (aims if kind == kinds[0] else aims[:1])
    ]
    numbers: dict[str, dict[str, Any]] = {unit.name: {} for unit in reproduction.units}
    found = await reproduction.each(trained, items)
    for (place, kind, aim), own in zip(items, found, strict=True):
        numbers[reproduction.units[place].name][f"{kind} {aim}"] = own
    return Outcome(numbers=numbers, text=TEXT)


def trained(reproduction: Reproduction, item: tuple[int, Kind, Aim]) -> dict[str, Any]:
    """Train one network of a bench and return its numbers."""
    place, kind, aim = item
    return train(reproduction, reproduction.units[place], kind, aim)


def train(reproduction: Reproduction, unit: Unit, kind: Kind, aim: Aim) -> dict[str, Any]:
    """Train a network, write its model where a simulation is its aim, and return its numbers.

    Args:
        reproduction: Run with the settings.
        unit: A bench, or a part of its recordings.
        kind: Family of the network.
        aim: Purpose of the network.
    """
    folder = reproduction.folder("networks", unit.name)
    config = reproduction.settings.training(kind, "prediction" if aim == "prediction" else IN_LOOP)
    if aim == "correction":
        reproduction.tell(f"  {unit.name}: {config.name} on what a servo with friction lacks")
        made = train_correction(unit.dataset, config, folder)
        write_model(reproduction.model_file(unit, "servo"), made.model)
        return {**asdict(made.servo), "share": made.share, "bound_n": made.bound}
    reproduction.tell(f"  {unit.name}: {config.name}")
    exported = train_to_file(unit.dataset, config, folder, report=lambda progress: None)
    assert exported is not None
    if aim == IN_LOOP:
        model = learned_model(exported.torchscript)
        write_model(reproduction.model_file(unit, "network"), model)
    held_out = exported.card.held_out
    return {} if held_out is None else {"test_force_rmse_n": held_out.force_rmse}


def learned_model(network: Path) -> Model:
    """Return the model in which a network pulls the nominal mechanism, as in the paper."""
    values = {"file": str(network.resolve()), "spool_radius": SPOOL_RADIUS}
    return Model(actuator=NamedValues(name="learned", values=values))
