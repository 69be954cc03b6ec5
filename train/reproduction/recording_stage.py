"""The recordings of every bench: made on virtual ones, or given."""

from __future__ import annotations

from train.reproduction.outcome import Outcome
from train.reproduction.reproduction import Reproduction
from train.reproduction.unit import Unit


def run(reproduction: Reproduction) -> Outcome:
    """Record what is missing and say what is there."""
    if reproduction.bench is not None and reproduction.is_virtual:
        reproduction.each(record, range(len(reproduction.settings.units)))
    units = reproduction.units
    lines = ["| bench | train [min] | test [min] |", "|---|---|---|"]
    lines += [f"| {u.name} | {train_minutes(u):.1f} | {test_minutes(u):.1f} |" for u in units]
    return Outcome(
        numbers={
            u.name: {
                "train_min": train_minutes(u), "test_min": test_minutes(u), "sha256": u.sha256,
            }
            for u in units
        },
        text="\n".join(lines),
    )  # fmt: skip


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


def train_minutes(unit: Unit) -> float:
    """Return how much there is to learn from [min]."""
    return sum(r.duration for r in unit.dataset.train) / 60.0


def test_minutes(unit: Unit) -> float:
    """Return how much there is to test on [min]."""
    return sum(r.duration for r in unit.experiments) / 60.0
