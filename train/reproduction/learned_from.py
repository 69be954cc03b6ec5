"""Models of one bench that have learned from a part of its recordings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from tendon_newton.dataset import Dataset
from tendon_newton.model_file import Model
from tendon_newton.recording import Recording
from train.actuator.run import train_to_file
from train.reproduction.closed_loop import Replayed, replayed
from train.reproduction.hybrid import train_hybrid
from train.reproduction.network_stage import learned_model
from train.reproduction.physical import refit
from train.reproduction.reproduction import BEST, Reproduction
from train.reproduction.unit import Unit, representative


@dataclass(frozen=True)
class Part(Unit):
    """A bench of whose train recordings only some are known."""

    known: Dataset

    @property
    def dataset(self) -> Dataset:  # pyright: ignore[reportIncompatibleVariableOverride]
        """The known recordings, and the test recordings."""
        return self.known


def learned_from(
    reproduction: Reproduction, unit: Unit, part: Dataset, name: str
) -> dict[str, Model]:
    """Return the physical model, the network and the hybrid that a part of a bench's data gives.

    The causes of the physical model are those that were named on the first bench; their numbers
    are fitted to the part.
    """
    folder = reproduction.folder("networks", f"{unit.name}_{name}")
    known = Part(name=unit.name, folder=unit.folder, known=part)
    config = reproduction.settings.training(purpose="simulation")
    reproduction.tell(f"  {unit.name}, {name}: physics, network, both")
    settings = reproduction.settings
    physical = refit(
        representative(known, settings.refit_seconds, settings.diagnosis_kinds),
        reproduction.model(unit, "physical"),
    )
    train_to_file(replace(part, test=()), config, folder, report=lambda progress: None)
    network = Path(folder) / f"{config.name}.pt"
    hybrid = train_hybrid(part, physical, config, folder)
    return dict(zip(BEST, (learned_model(network), physical, hybrid), strict=True))


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
