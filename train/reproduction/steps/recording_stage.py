"""The recordings of every bench: made on virtual ones, or given."""

from __future__ import annotations

from typing import Any

from train.reproduction.outcome import Outcome, read_outcome
from train.reproduction.reproduction import Reproduction


def run(reproduction: Reproduction) -> Outcome:
    """Record what is missing and say what is there."""
    if reproduction.bench is not None and reproduction.is_virtual:
        reproduction.each(record, range(len(reproduction.settings.units)))
    units, before = reproduction.units, read_outcome(reproduction.outcome_file("recordings"), "")
    known = {} if before is None else before.numbers
    numbers = {unit.name: known.get(unit.name, {}) for unit in units}
    new = [p for p, u in enumerate(units) if numbers[u.name].get("sha256") != u.sha256]
    for place, own in zip(new, reproduction.each(minutes, new), strict=True):
        numbers[units[place].name] = own
    lines = ["| bench | train [min] | test [min] |", "|---|---|---|"]
    lines += [
        f"| {name} | {own['train_min']:.1f} | {own['test_min']:.1f} |"
        for name, own in numbers.items()
    ]
    return Outcome(numbers=numbers, text="\n".join(lines))


def record(reproduction: Reproduction, place: int) -> None:
    """Record what is missing of one bench; the first one has the whole plan."""
    assert reproduction.bench is not None
    settings = reproduction.settings
    reproduction.bench.record(
        settings.units[place],
        reproduction.units[place].folder,
        seed=settings.seed,
        most=None if place == 0 else settings.runs_of_kind,
    )


def minutes(reproduction: Reproduction, place: int) -> dict[str, Any]:
    """Return how much there is of one bench to learn from and to test on [min], and its hash."""
    unit = reproduction.units[place]
    reproduction.tell(f"  {unit.name}: reading")
    train, test = (sum(r.duration for r in p) for p in (unit.dataset.train, unit.experiments))
    return {"train_min": train / 60.0, "test_min": test / 60.0, "sha256": unit.sha256}
