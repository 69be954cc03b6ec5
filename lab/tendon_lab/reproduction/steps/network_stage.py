"""Force networks of every bench, trained and written as models."""

from pathlib import Path
from typing import Any

from tendon_lab.reproduction.outcome import Outcome
from tendon_lab.reproduction.physical import SPOOL_RADIUS
from tendon_lab.reproduction.reproduction import Reproduction
from tendon_newton.data.model_file import Model, NamedValues, write_model
from tendon_train.actuator.fitting.run import train_to_file
from tendon_train.actuator.training_config import Kind, Purpose

IN_LOOP: Purpose = "simulation"
TEXT = """\
The first kind is trained twice on every bench: along measured motion, and for the loop of a
simulation."""


def run(reproduction: Reproduction) -> Outcome:
    """Train what is missing: every kind on the first bench, one kind on the others."""
    kinds = reproduction.settings.kinds
    aims: tuple[Purpose, ...] = ("prediction", IN_LOOP)
    items = [
        (place, kind, aim)
        for place in range(len(reproduction.units))
        for kind in kinds[: None if place == 0 else 1]
        for aim in (aims if kind == kinds[0] else aims[:1])
    ]
    numbers: dict[str, dict[str, Any]] = {unit.name: {} for unit in reproduction.units}
    found = reproduction.each(trained, items)
    for (place, kind, aim), own in zip(items, found, strict=True):
        numbers[reproduction.units[place].name][f"{kind} {aim}"] = own
    return Outcome(numbers=numbers, text=TEXT)


def trained(reproduction: Reproduction, item: tuple[int, Kind, Purpose]) -> dict[str, Any]:
    """Train one network of a bench and return its numbers.

    Where a simulation is its aim, its model is written too.
    """
    place, kind, aim = item
    unit, config = reproduction.units[place], reproduction.settings.training(kind, aim)
    folder = reproduction.folder("networks", unit.name)
    reproduction.tell(f"  {unit.name}: {config.name}")
    exported = train_to_file(unit.dataset, config, folder, report=lambda progress: None)
    if aim == IN_LOOP:
        model = learned_model(exported.torchscript)
        write_model(reproduction.model_file(unit, "network"), model)
    held_out = exported.card.held_out
    return {} if held_out is None else {"test_force_rmse_n": held_out.force_rmse}


def learned_model(network: Path) -> Model:
    """Return the model in which a network pulls the nominal mechanism, as in the paper."""
    values = {"file": str(network.resolve()), "spool_radius": SPOOL_RADIUS}
    return Model(actuator=NamedValues(name="learned", values=values))
