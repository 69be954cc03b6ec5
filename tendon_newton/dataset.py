"""A dataset: a folder of recordings with ``dataset.toml``, split by recording."""

import os.path
from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import Any, Literal

from tendon_newton.bench_overrides import read_bench_overrides, write_bench_overrides
from tendon_newton.errors import InvalidDataset, TendonNewtonError
from tendon_newton.recording import Recording
from tendon_newton.recording_csv import read_csv, write_csv
from tendon_newton.toml_file import read_toml, refuse_unknown_keys, write_toml

FILE_NAME = "dataset.toml"
SPLITS = ("train", "test")
REQUIRED_KEYS = ("file", "bench", "split")
KNOWN_KEYS = (*REQUIRED_KEYS, "start", "bench_overrides", "actuator_overrides", "load_cell_rate")
KEY_TYPES: dict[str, tuple[type | tuple[type, ...], str]] = {
    "file": (str, "a string"),
    "bench": (str, "a string"),
    "split": (str, "a string"),
    "start": (str, "a string"),
    "bench_overrides": (dict, "a table"),
    "actuator_overrides": (dict, "a table"),
    "load_cell_rate": ((int, float), "a number"),
}

Entry = dict[str, Any]
"""One ``[[recordings]]`` table as TOML gives it; never leaves this file."""


@dataclass(frozen=True, kw_only=True)
class Dataset:
    """Recordings to fit and recordings that only report."""

    path: Path
    """The folder."""
    train: tuple[Recording, ...]
    """Recordings that a fit may see."""
    test: tuple[Recording, ...]
    """Recordings that are never fitted."""


def load_dataset(path: Path, *, require_train: bool = True, require_test: bool = True) -> Dataset:
    """Read and check a dataset.

    Args:
        path: The folder that holds ``dataset.toml``.
        require_train: Refuse a dataset without a train split.
        require_test: Refuse a dataset without a test split.
    """
    where = path / FILE_NAME
    entries = read_entries(path)
    counts = {split: sum(entry["split"] == split for entry in entries) for split in SPLITS}
    if require_train and not counts["train"]:
        raise InvalidDataset(
            f'{where}: some recording must have split = "train", to fit the model on; '
            f'all {counts["test"]} have split = "test"'
        )
    if require_test and not counts["test"]:
        raise InvalidDataset(
            f'{where}: some recording must have split = "test", to report errors on data that '
            f'no fit has seen; all {counts["train"]} have split = "train": '
            'give at least one whole recording split = "test"'
        )
    splits: dict[str, list[Recording]] = {split: [] for split in SPLITS}
    for entry in entries:
        splits[entry["split"]].append(read_recording(path, entry))
    return Dataset(path=path, train=tuple(splits["train"]), test=tuple(splits["test"]))


def write_dataset(path: Path, train: Sequence[Recording], test: Sequence[Recording]) -> None:
    """Write recordings as CSV and the ``dataset.toml`` that lists them."""
    path.mkdir(parents=True, exist_ok=True)
    entries = []
    for split, recordings in (("train", train), ("test", test)):
        for recording in recordings:
            file = path / recording.name
            file.parent.mkdir(parents=True, exist_ok=True)
            write_csv(file, recording)
            entries.append(entry_of(recording, split))
    write_toml(path / FILE_NAME, {}, recordings=entries)


def read_entries(path: Path) -> list[Entry]:
    """Read and check ``dataset.toml`` without opening the recordings."""
    where = path / FILE_NAME
    if not path.is_dir():
        came = "it is a file: give the folder that holds it" if path.exists() else "no such folder"
        raise InvalidDataset(f"{path}: a dataset is a folder with {FILE_NAME}; {came}")
    if not where.is_file():
        raise InvalidDataset(f"{path}: a dataset is a folder with {FILE_NAME}; it holds none")
    table = read_toml(where, InvalidDataset)
    refuse_unknown_keys(table, ("recordings",), str(where), InvalidDataset)
    entries = table.get("recordings", [])
    if not isinstance(entries, list) or not all(isinstance(entry, dict) for entry in entries):
        raise InvalidDataset(f"{where}: recordings must be an array of tables, [[recordings]]")
    if not entries:
        raise InvalidDataset(f"{where}: a dataset lists one [[recordings]] or more; it lists none")
    for index, entry in enumerate(entries):
        check_entry(entry, f"{where}: [[recordings]] {index}")
    files = [os.path.normpath(entry["file"]) for entry in entries]
    for entry, file in zip(entries, files, strict=True):
        if files.count(file) > 1:
            raise InvalidDataset(
                f"{where}: a recording belongs to one split and is listed once; "
                f"{entry['file']!r} is listed {files.count(file)} times"
            )
    return entries


def check_entry(entry: Entry, where: str) -> None:
    """Refuse an entry with missing, unknown or mistyped keys."""
    refuse_unknown_keys(entry, KNOWN_KEYS, where, InvalidDataset)
    for key in REQUIRED_KEYS:
        if key not in entry:
            raise InvalidDataset(f"{where}: key {key!r} is missing; there are {', '.join(entry)}")
    where = f"{where} ({entry['file']!r})"
    for key, value in entry.items():
        types, words = KEY_TYPES[key]
        if not isinstance(value, types) or isinstance(value, bool):
            raise InvalidDataset(f"{where}: {key} must be {words}; it is {value!r}")
    if entry["split"] not in SPLITS:
        raise InvalidDataset(f"{where}: split must be 'train' or 'test'; it is {entry['split']!r}")
    file = os.path.normpath(entry["file"])
    if not entry["file"] or Path(file).is_absolute() or Path(file).parts[:1] in ((), ("..",)):
        raise InvalidDataset(
            f"{where}: file must lie inside the dataset's folder; it is {entry['file']!r}"
        )


def read_recording(path: Path, entry: Entry) -> Recording:
    """Read the recording that an entry lists."""
    name = entry["file"]
    file = path / name
    if file.is_dir() or file.suffix in (".mcap", ".db3"):
        kind = "rosbag2 folders" if file.is_dir() else f"{file.suffix} files"
        raise InvalidDataset(
            f"{name}: {kind} are not supported yet by this version; export to CSV ({file})"
        )
    where = f"{path / FILE_NAME}: {name}"
    try:
        overrides = read_bench_overrides(entry.get("bench_overrides", {}))
    except TendonNewtonError as error:
        raise InvalidDataset(f"{where}: {error}") from error
    start: Literal["equilibrium", "first_row"] = entry.get("start", "equilibrium")
    rate = entry.get("load_cell_rate")
    return read_csv(
        file,
        name=name,
        bench=entry["bench"],
        start=start,
        bench_overrides=overrides,
        actuator_overrides=read_numbers(entry.get("actuator_overrides", {}), where),
        load_cell_rate=None if rate is None else float(rate),
    )


def read_numbers(table: dict[str, Any], where: str) -> dict[str, float]:
    """Read actuator numbers; which keys an actuator knows is checked where it is built."""
    for key, value in table.items():
        if isinstance(value, bool) or not isinstance(value, int | float) or not isfinite(value):
            raise InvalidDataset(
                f"{where}: actuator override {key!r} must be a finite number; it is {value!r}"
            )
    return {key: float(value) for key, value in table.items()}


def entry_of(recording: Recording, split: str) -> Entry:
    """Make the ``[[recordings]]`` table of a recording; defaults are left out."""
    entry: Entry = {"file": recording.name, "bench": recording.bench, "split": split}
    if recording.start != "equilibrium":
        entry["start"] = recording.start
    if overrides := write_bench_overrides(recording.bench_overrides):
        entry["bench_overrides"] = overrides
    if recording.actuator_overrides:
        entry["actuator_overrides"] = dict(recording.actuator_overrides)
    if recording.load_cell_rate is not None:
        entry["load_cell_rate"] = recording.load_cell_rate
    return entry
