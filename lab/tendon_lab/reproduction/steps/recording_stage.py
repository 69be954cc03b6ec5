"""The recordings of every bench: made on virtual ones, or given."""

from typing import Any

from tendon_lab.reproduction.outcome import Outcome
from tendon_lab.reproduction.reproduction import Reproduction


def run(reproduction: Reproduction) -> Outcome:
    """Record what is missing and say what is there."""
    if reproduction.bench is not None and reproduction.is_virtual:
        reproduction.each(record, range(len(reproduction.settings.units)), keep=False)
    found = reproduction.each(minutes, range(len(reproduction.units)))
    numbers = {unit.name: own for unit, own in zip(reproduction.units, found, strict=True)}
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
