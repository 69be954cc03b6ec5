"""A reproduction under way: its settings, its folder, its benches, and what is already there."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from tendon_newton.data.model_file import Model, load_model, write_model
from tendon_newton.errors import InvalidDataset
from train.actuator.ideal import PAPER_GAIN, SERVO_LIMIT, refitted_gain
from train.actuator.samples.folds import file_hash, usable
from train.reproduction.bench import ReproductionBench
from train.reproduction.physical import with_ideal
from train.reproduction.pieces import Work, Workers, kept, piece_file, read_piece, result_of
from train.reproduction.settings import ReproductionSettings
from train.reproduction.unit import Unit

MODELS: dict[str, str] = {
    "ideal": "ideal source, 4.2 N/rad",
    "ideal_refitted": "ideal source, P refitted",
    "network": "Transformer",
    "physical": "diagnosed physical model",
    "hybrid": "physics and network",
}
"""Models that are compared: name of their file, and in words."""
IDEALS = ("ideal", "ideal_refitted")
BEST = ("network", "physical", "hybrid")
"""Those that must win against the better ideal source."""


def silent(text: str) -> None:
    """Say nothing."""


@dataclass(frozen=True)
class Reproduction:
    """What every stage is given."""

    settings: ReproductionSettings
    out: Path
    """Folder for everything."""
    bench: ReproductionBench | None = None
    """Makes the recordings; none where they are given."""
    folders: tuple[Path, ...] = ()
    """Recordings of benches that are given, one folder each."""
    policies: tuple[Path, ...] = ()
    """Policies that are given."""
    causes: Path | None = None
    """Model file whose causes are fitted to every bench, in place of a diagnosis."""
    tell: Callable[[str], None] = field(default=silent)
    """Told what is being done; a function of a module where there are several processes."""
    workers: Workers | None = None
    """Processes that do the pieces of stages; this one does them if none."""
    pieces: Path | None = None
    """Where the stage that is being run keeps the results of its pieces; nowhere if none."""

    @property
    def is_virtual(self) -> bool:
        """Whether the benches are not real ones."""
        return not self.folders

    @cached_property
    def units(self) -> tuple[Unit, ...]:
        """The benches."""
        if self.folders:
            return tuple(Unit(name=folder.name, folder=folder) for folder in self.folders)
        return tuple(
            Unit(name=f"unit_{number}", folder=self.out / "data" / f"unit_{number}")
            for number in self.settings.units
        )

    @property
    def caption(self) -> str:
        """What every caption says of the bench."""
        return "Virtual bench, no measurement." if self.is_virtual else "Measured."

    def key(self, stage: str, needs: Sequence[str] = ()) -> str:
        """Return the hash of all that a stage's outcome is made from.

        Args:
            stage: Its name.
            needs: Stages whose files it reads; their outcomes, as they are now, count.
        """
        table: dict[str, Any] = {
            "stage": stage,
            "settings": asdict(self.settings),
            "data": [unit.sha256 for unit in self.units],
            "policies": [file_hash(path) for path in self.policies],
            "needs": {need: file_hash(self.outcome_file(need)) for need in needs},
        }
        if self.causes is not None:
            table["causes"] = file_hash(self.causes)
        return hashlib.sha256(json.dumps(table, sort_keys=True).encode()).hexdigest()

    def outcome_file(self, stage: str) -> Path:
        """Return where a stage's outcome is kept."""
        return self.out / "stages" / f"{stage}.json"

    def each(self, work: Work, items: Sequence[Any]) -> list[Any]:
        """Return what a function makes of this reproduction and each item.

        Args:
            work: What is done, a function of a module; its results are what JSON can hold, and
                those that an interrupted run has kept are read.
            items: Numbers, names, and tuples of them.
        """
        found: dict[int, Any] = {}
        paths = [None if self.pieces is None else piece_file(self.pieces, work, i) for i in items]
        for place, path in enumerate(paths):
            if path is not None and path.is_file():
                found[place] = read_piece(path)
        left = [place for place in range(len(items)) if place not in found]
        if self.workers is None:
            for place in left:
                found[place] = kept(result_of(work, self, items[place]), paths[place])
        else:
            alone = replace(self, workers=None)
            pieces = [(items[place], paths[place]) for place in left]
            found |= zip(left, self.workers.done(work, alone, pieces), strict=True)
        return [found[place] for place in range(len(items))]

    def folder(self, *parts: str) -> Path:
        """Return a folder below the reproduction's own; it is made."""
        path = self.out.joinpath(*parts)
        path.mkdir(parents=True, exist_ok=True)
        return path

    def model_file(self, unit: Unit, model: str) -> Path:
        """Return where a model of a bench stands."""
        return self.folder("models", unit.name) / f"{model}.toml"

    def model(self, unit: Unit, model: str) -> Model:
        """Return a model of a bench; an ideal source needs no stage that makes it.

        Raises:
            InvalidDataset: No recording has a force to fit a gain to.
        """
        path = self.model_file(unit, model)
        if model in IDEALS and not path.is_file():
            gain = PAPER_GAIN
            if model == "ideal_refitted":
                recordings = usable(unit.dataset.train)
                if not recordings:
                    raise InvalidDataset(f"{unit.folder}: needs train recordings with a force")
                gain = refitted_gain(recordings, SERVO_LIMIT)
            beside = path.with_name(f".{model}_{os.getpid()}.toml")
            write_model(beside, with_ideal(gain))  # other processes may make the same
            beside.replace(path)
        return load_model(path)
