"""One bench's recordings: those that models learn from, and those of the paper's experiments."""

import hashlib
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from pathlib import Path

from tendon_lab.force_scoring.sample_protocol import experiment_of, step_hold
from tendon_newton.data.dataset import FILE_NAME, Dataset, load_dataset
from tendon_newton.data.files.origin import file_hash
from tendon_newton.data.files.toml_file import read_toml
from tendon_newton.data.recording import Recording
from tendon_newton.errors import InvalidDataset
from tendon_newton.identification.cutting import beginning

RECORDINGS, EXPERIMENTS = "recordings", "experiments"
"""Folders of a bench: the plan of the paper, and what must be recorded besides."""
BLOCKED = ("tape_roll", "hand", "perturbation")
"""Words in the name of a recording in which something was in the mechanism's way."""


@dataclass(frozen=True)
class Unit:
    """A bench's folder and what was recorded on it."""

    name: str  # Name of the unit in tables
    folder: Path  # Holds a dataset, or the folders `RECORDINGS` and `EXPERIMENTS`, each a dataset

    @cached_property
    def dataset(self) -> Dataset:
        """The recordings that models learn from, and the test recordings of the same plan."""
        inner = self.folder / RECORDINGS
        return dataset_of(inner if inner.is_dir() else self.folder, self.sha256)

    @cached_property
    def experiments(self) -> tuple[Recording, ...]:
        """All test recordings."""
        extra = self.folder / EXPERIMENTS
        if not (extra / FILE_NAME).is_file():
            return self.dataset.test
        return (*self.dataset.test, *dataset_of(extra, self.sha256, require_train=False).test)

    @cached_property
    def sha256(self) -> str:
        """Hash of every file that its datasets list, and of their lists."""
        digest = hashlib.sha256()
        for listing in sorted(self.folder.rglob(FILE_NAME)):
            entries = read_toml(listing, InvalidDataset, "a dataset lists its recordings")
            for file in [listing, *(listing.parent / e["file"] for e in entries["recordings"])]:
                digest.update(file.relative_to(self.folder).as_posix().encode())
                digest.update(file_hash(file).encode())
        return digest.hexdigest()

    def find(self, bench: str, kind: str) -> Recording:
        """Return the first test recording of a kind on a bench.

        Raises:
            InvalidDataset: There is none.
        """
        found = [r for r in self.experiments if r.bench == bench and kind_of(r) == kind]
        if not found:
            raise InvalidDataset(
                f"{self.folder}: needs a test recording of {kind} on {bench}, named "
                f"{bench}_{kind}_0; there are {', '.join(r.name for r in self.experiments)}"
            )
        return found[0]


@lru_cache(maxsize=32)
def dataset_of(folder: Path, sha256: str, *, require_train: bool = True) -> Dataset:
    """Return a dataset as `load_dataset` does; it takes seconds, and every piece of a stage asks.

    Args:
        folder: Holds it.
        sha256: Hash of the bench's files, so that others are read anew.
        require_train: Whether it must have train recordings.
    """
    return load_dataset(folder, require_train=require_train)


def kind_of(recording: Recording) -> str:
    """Return what was done in a recording: its name without bench and number."""
    return experiment_of(recording).kind


def is_blocked(recording: Recording) -> bool:
    """Tell whether something was in the mechanism's way, by the recording's name."""
    return any(word in kind_of(recording) for word in BLOCKED)


def interleaved(recordings: Iterable[Recording]) -> list[Recording]:
    """Return recordings so that the first of every kind come before the second of any."""
    seen: dict[str, int] = {}
    places = []
    for recording in recordings:
        kind = kind_of(recording)
        seen[kind] = seen.get(kind, 0) + 1
        places.append((seen[kind], len(places), recording))
    return [recording for _, _, recording in sorted(places, key=lambda place: place[:2])]


def representative(unit: Unit, seconds: float, kinds: int | None = None) -> Dataset:
    """Return the beginning of one free recording of every bench and kind, for fits of physics.

    Args:
        unit: The bench.
        seconds: Length of each recording [s].
        kinds: Kinds of each bench, in the order in which they were recorded; all of them if none.
    """
    free = [r for r in unit.dataset.train if r.force is not None and not is_blocked(r)]
    first: dict[str, dict[str, Recording]] = {}
    for recording in free:
        first.setdefault(recording.bench, {}).setdefault(kind_of(recording), recording)
    kept = [r for own in first.values() for r in list(own.values())[:kinds]]
    test = [r for r in unit.dataset.test if step_hold(r) is not None] or list(unit.dataset.test)
    return replace(
        unit.dataset,
        train=tuple(beginning(r, seconds) for r in kept),
        test=tuple(beginning(r, 2.0 * seconds) for r in interleaved(test)[:3]),
    )
