"""Networks that know only a part of the first bench's recordings."""

from __future__ import annotations

from typing import Any

from train.reproduction.outcome import Outcome
from train.reproduction.parts import part_named, part_names
from train.reproduction.reproduction import Reproduction
from train.reproduction.trainings import Aim, train

AIMS: tuple[Aim, ...] = ("simulation", "correction")


def run(reproduction: Reproduction) -> Outcome:
    """Train what is missing, for every part."""
    items = [(name, aim) for name in part_names(reproduction) for aim in AIMS]
    found = reproduction.each(trained, items)
    return Outcome(
        numbers={f"{name} {aim}": own for (name, aim), own in zip(items, found, strict=True)}
    )


def trained(reproduction: Reproduction, item: tuple[str, Aim]) -> dict[str, Any]:
    """Train one network on a part of the data and return its numbers."""
    name, aim = item
    part = part_named(reproduction, name)
    return train(reproduction, part, reproduction.settings.kinds[0], aim)
