"""A reproduction under way: its settings, its folder, its benches, and what is already there."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property, partial
from pathlib import Path
from typing import Any, Protocol

from tendon_lab.force_scoring.ideal_baseline import PAPER_GAIN, refitted_gain
from tendon_lab.reproduction.physical import with_ideal
from tendon_lab.reproduction.settings import ReproductionSettings
from tendon_lab.reproduction.unit import Unit
from tendon_newton.data.files.json_file import read_json, write_json
from tendon_newton.data.files.origin import file_hash
from tendon_newton.data.files.text_file import write_text
from tendon_newton.data.model_file import Model, load_model, write_model
from tendon_newton.errors import InvalidDataset, InvalidOutput, shown
from tendon_train.actuator.samples.folds import usable
from tendon_train.actuator.training_config import SERVO_LIMIT


class ReproductionBench(Protocol):
    """Makes recordings; real ones need none."""

    def record(self, unit: int, out: Path, *, seed: int, most: int | None) -> None:
        """Record the paper's plan and its further experiments on one unit.

        Args:
            unit: Number of the unit.
            out: Folder of the recordings; what is there is not recorded again.
            seed: Seed of the plan's draws.
            most: Train runs of each kind; all of the plan if none.
        """


MODELS: dict[str, str] = {
    "ideal": "ideal source, 4.2 N/rad",
    "ideal_refitted": "ideal source, P refitted",
    "network": "Transformer",
    "physical": "diagnosed physical model",
}
"""Models that are compared: name of their file, and in words."""
IDEALS = ("ideal", "ideal_refitted")
BEST = ("network", "physical")  # Those that must win against the better ideal source

Work = Callable[[Any, Any], Any]
"""(reproduction, item) -> what JSON can hold; a module's function, so that a process finds it."""


class NotDone(Exception):
    """A result is neither there nor wanted."""


def silent(text: str) -> None:
    """Say nothing."""


@dataclass(frozen=True)
class Reproduction:
    """Settings, folders and results that every stage is given."""

    settings: ReproductionSettings
    out: Path  # Folder for everything
    bench: ReproductionBench | None = None  # Makes the recordings; none where they are given
    folders: tuple[Path, ...] = ()  # Recordings of benches that are given, one folder each
    causes: Path | None = None
    """Model file whose causes are fitted to every bench, in place of a diagnosis."""
    tell: Callable[[str], None] = field(default=silent)
    """Told what is being done; a function of a module where there are several processes."""
    executor: Executor | None = None
    """Does the jobs; without one only results that are there can be had."""

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

    @cached_property
    def results(self) -> Path:
        """Folder of the results of jobs, once recordings are there.

        It has the hash of all that decides a result: settings, recordings, what is given.
        """
        table = {**self.inputs, "data": [unit.sha256 for unit in self.units]}
        digest = hashlib.sha256(json.dumps(table, sort_keys=True).encode()).hexdigest()
        return self.folder("results", digest[:16])

    @cached_property
    def inputs(self) -> dict[str, Any]:
        """Return all that is known to decide results before anything is recorded."""
        return {
            **asdict(self.settings),
            "recordings": [unit.sha256 for unit in self.units if self.folders],
            "causes": None if self.causes is None else file_hash(self.causes),
        }

    def begin(self) -> None:
        """Take the folder, which has networks and models of one reproduction.

        Raises:
            InvalidOutput: It is another one's.
        """
        path = self.out / "inputs.json"
        inputs = json.loads(json.dumps(self.inputs))
        promise = "what a reproduction began with stands in a JSON file"
        begun = read_json(path, InvalidOutput, promise) if path.exists() else inputs
        for key, value in inputs.items():
            if begun.get(key) != value:
                raise InvalidOutput(
                    f"{path}: what is here began with {key} = {shown(begun.get(key))}, and now it "
                    f"is {shown(value)}; use another folder"
                )
        write_json(path, inputs)

    def each(self, work: Work, items: Sequence[Any], *, keep: bool = True) -> list[Any]:
        """Return what a function makes of this reproduction and each item, side by side.

        Args:
            work: The job; its results are what JSON can hold.
            items: Numbers, names, and tuples of them.
            keep: Whether results stay in files, so that a later run reads them.

        Raises:
            NotDone: A result is not there, and this reproduction does no jobs.
        """
        begun = [self._begin(work, item, keep) for item in items]  # all, before one is waited for
        return [result() for result in begun]

    def _begin(self, work: Work, item: Any, keep: bool) -> Callable[[], Any]:
        """Begin a job whose result is not kept, and return what waits for the result."""
        path = self._result_file(work, item) if keep else None
        if path is not None and path.is_file():
            return partial(result_in, path)
        if self.executor is None:
            raise NotDone
        return self.executor.submit(done, work, replace(self, executor=None), item, path).result

    def _result_file(self, work: Work, item: Any) -> Path:
        """Return where a result is kept."""
        words = json.dumps(item).encode()
        return self.results / f"{work.__name__}_{hashlib.sha256(words).hexdigest()[:16]}.json"

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


def result_in(path: Path) -> Any:
    """Return a result that an earlier run has kept."""
    return read_json(path, InvalidOutput, "a result is a JSON file")["result"]


def done(work: Work, reproduction: Reproduction, item: Any, path: Path | None) -> Any:
    """Do a job, its simulations on the CPU, and return its result as a file has it.

    Fits and replays have few worlds and many steps that follow each other, where a GPU is slower
    than a core; what needs a GPU asks for it.
    """
    import warp as wp

    from tendon_newton.device_code.quiet import quiet_warp

    quiet_warp()
    with wp.ScopedDevice("cpu"):
        text = json.dumps({"result": work(reproduction, item)}) + "\n"
    if path is not None:
        write_text(path, text)
    return json.loads(text)["result"]
