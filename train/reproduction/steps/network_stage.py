"""Force networks of every bench."""

from typing import Any

from train.actuator.training_config import Kind
from train.reproduction.networks import Aim, train
from train.reproduction.outcome import Outcome
from train.reproduction.reproduction import Reproduction

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
