"""Parts of the first bench's recordings, and the models that learn from them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from tendon_newton.data.dataset import Dataset
from tendon_newton.data.model_file import Model, load_model
from tendon_newton.data.recording import Recording
from train.reproduction.closed_loop import Replayed, replayed
from train.reproduction.hybrid import hybrid_of
from train.reproduction.physical import refit
from train.reproduction.reproduction import Reproduction
from train.reproduction.unit import Unit, free_only, of_benches, representative, shortened

WITHOUT_STRONG, FREE = "without_strong", "free"
SEEN = ("finger", "spring_weak")
"""Benches of those that have never seen the strong spring."""
MINUTES = "_minutes"


@dataclass(frozen=True)
class Part(Unit):
    """A bench of whose train recordings only some are known, and whose test recordings are not."""

    known: Dataset

    @property
    def dataset(self) -> Dataset:  # pyright: ignore[reportIncompatibleVariableOverride]
        """The known recordings."""
        return self.known


def part_names(reproduction: Reproduction) -> tuple[str, ...]:
    """Return the names of all parts: so many minutes, two of three benches, free motion."""
    whole = reproduction.units[0].dataset
    points = [f"{point:g}{MINUTES}" for point in reproduction.settings.curve_minutes]
    less = [name for name in points if part_named(reproduction, name).known.train != whole.train]
    return (*less, WITHOUT_STRONG, FREE)


def part_named(reproduction: Reproduction, name: str) -> Part:
    """Return a part of the first bench's recordings."""
    unit = reproduction.units[0]
    whole = unit.dataset
    if name.endswith(MINUTES):
        known = shortened(whole, float(name.removesuffix(MINUTES)) * train_share(whole))
    else:
        known = of_benches(whole, SEEN) if name == WITHOUT_STRONG else free_only(whole)
    return Part(name=f"{unit.name}_{name}", folder=unit.folder, known=replace(known, test=()))


def train_share(dataset: Dataset) -> float:
    """Return which share of the minutes of a bench's recordings is there to learn from [1]."""
    train, test = (sum(r.duration for r in part) for part in (dataset.train, dataset.test))
    return train / (train + test)


def learned_from(reproduction: Reproduction, name: str) -> dict[str, Model]:
    """Return the network, the physical model and the hybrid that a part of the data gives.

    The causes of the physical model are those that were named on the first bench; their numbers
    are fitted to the part.
    """
    unit, settings = reproduction.units[0], reproduction.settings
    part = part_named(reproduction, name)
    reproduction.tell(f"  {part.name}: physics, and replays")
    known = replace(part, known=replace(part.known, test=unit.dataset.test))
    physical = refit(
        representative(known, settings.refit_seconds, settings.refit_kinds),
        reproduction.model(unit, "physical"),
    )
    network, servo = (load_model(reproduction.model_file(part, m)) for m in ("network", "servo"))
    hybrid = hybrid_of(servo, physical, known.dataset)
    return {"network": network, "physical": physical, "hybrid": hybrid}


def force_errors(
    reproduction: Reproduction, recordings: Sequence[Recording], model: Model
) -> list[float]:
    """Return the error of the tension in closed loop on each recording, RMS [N]."""
    return [r.force_error for r in replays(reproduction, recordings, model)]


def replays(
    reproduction: Reproduction, recordings: Sequence[Recording], model: Model
) -> list[Replayed]:
    """Replay recordings as every stage does."""
    return replayed(recordings, model, time_step=reproduction.settings.time_step)
