"""A dataset: a folder of recordings with ``dataset.toml``, split by recording."""

import logging
import os.path
import shlex
import signal
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from logging.handlers import BufferingHandler
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypeVar

from tendon_newton.data.bench_overrides import read_bench_overrides, write_bench_overrides
from tendon_newton.data.files.checked_table import CheckedTable
from tendon_newton.data.files.file_names import check_path
from tendon_newton.data.files.html_table import html_table
from tendon_newton.data.files.text_file import kept_inside
from tendon_newton.data.files.toml_file import read_toml, refuse_unknown_keys, write_toml
from tendon_newton.data.files.values import are_tables
from tendon_newton.data.formats.any_file import read_recording_file
from tendon_newton.data.formats.csv_file import write_csv
from tendon_newton.data.formats.mapped_column import read_topic_mapping
from tendon_newton.data.recording import FREE, Recording
from tendon_newton.data.recording_plot import overview_figure
from tendon_newton.errors import InvalidDataset, TendonNewtonError, listed, shown

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Item = TypeVar("Item")

WORTH_A_PROCESS = 4_000_000
"""Size [bytes] of the files of messages from which further processes pay: they start in a second,
in which one megabyte is decoded."""
MESSAGE_FILES = (".mcap", ".db3")
"""Endings of files that are decoded message by message; a CSV file is read at once."""


def process_count(files: Sequence[Path], jobs: int) -> int:
    """Return in how many processes to read files, at most one for each."""
    heavy = [f for f in files if f.suffix in MESSAGE_FILES and f.is_file()]
    size = sum(f.stat().st_size for f in heavy)
    return max(1, min(jobs, len(heavy))) if size > WORTH_A_PROCESS else 1


def read_all(
    read: Callable[[Item], Recording], items: Sequence[Item], processes: int
) -> list[Recording]:
    """Read recordings in their order; what reading warns of is told here.

    Args:
        read: What reads one, a function of a module.
    """
    if processes == 1:
        return [read(item) for item in items]
    from tendon_newton.scheduler import JobOptions, open_executor

    out: list[Recording] = []
    with open_executor(JobOptions(jobs=processes)) as executor:
        for recording, warnings in executor.map(partial(read_aside, read), items):
            for record in warnings:
                logging.getLogger(record.name).handle(record)
            out.append(recording)
    return out


def read_aside(
    read: Callable[[Item], Recording], item: Item
) -> tuple[Recording, list[logging.LogRecord]]:
    """Read one recording in a process of its own, which Ctrl-C leaves to the first one to end."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    kept = BufferingHandler(1000)
    root = logging.getLogger()
    root.addHandler(kept)
    try:
        return read(item), list(kept.buffer)
    finally:
        root.removeHandler(kept)


FILE_NAME = "dataset.toml"
SPLITS = ("train", "test")
LOG_SUFFIXES = (".csv", ".json", ".jsonl", ".ndjson", ".mcap", ".db3")
"""Endings of logs that a mapping explains."""
REQUIRED_KEYS = ("file", "bench", "split")
WORD, TABLE = (str, "a string"), (dict, "a table")
KEY_TYPES: dict[str, tuple[type | tuple[type, ...], str]] = {
    **dict.fromkeys((*REQUIRED_KEYS, "mapping", "start", "obstacle"), WORD),
    **dict.fromkeys(("bench_overrides", "actuator_overrides"), TABLE),
    "load_cell_rate": ((int, float), "a number"),
}

Entry = dict[str, Any]  # One ``[[recordings]]`` table as TOML gives it; never leaves this file


@dataclass(frozen=True, kw_only=True)
class Dataset:
    """Recordings to fit and recordings that only report."""

    path: Path
    """Folder of ``dataset.toml`` and its recordings."""
    train: tuple[Recording, ...]
    """Recordings that a fit may see."""
    test: tuple[Recording, ...]
    """Recordings that are never fitted."""

    def __repr__(self) -> str:
        every = (*self.train, *self.test)
        benches = ", ".join(dict.fromkeys(recording.bench for recording in every))
        return (
            f"Dataset({str(self.path)!r}: {len(self.train)} train, {len(self.test)} test; "
            f"{benches}; {sum(recording.duration for recording in every):.0f} s)"
        )

    def _repr_html_(self) -> str:
        """List its recordings in a notebook."""
        rows = [
            (r.name, split, r.bench, f"{r.duration:.1f} s", ", ".join(r.signals))
            for split in SPLITS
            for r in getattr(self, split)
        ]
        return html_table(repr(self), ("recording", "split", "bench", "length", "signals"), rows)

    def plot(self) -> "Figure":
        """Draw command and angle of every recording."""
        return overview_figure((*self.train, *self.test))


def load_dataset(
    path: str | Path, *, require_train: bool = True, require_test: bool = True, jobs: int = 1
) -> Dataset:
    """Read and check a dataset.

    Args:
        path: The folder that holds ``dataset.toml``.
        require_train: Refuse a dataset without a train split.
        require_test: Refuse a dataset without a test split.
        jobs: Processes at most that read large files of messages side by side. Each is a fresh
            interpreter, so a script that asks for them needs ``if __name__ == "__main__"``.
    """
    path = Path(path)
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
    processes = process_count([path / entry["file"] for entry in entries], jobs)
    recordings = read_all(partial(read_recording, path), entries, processes)
    train, test = (
        tuple(r for r, entry in zip(recordings, entries, strict=True) if entry["split"] == split)
        for split in SPLITS
    )
    return Dataset(path=path, train=train, test=test)


def write_dataset(path: Path, train: Sequence[Recording], test: Sequence[Recording]) -> None:
    """Write recordings as CSV and the ``dataset.toml`` that lists them."""
    path.mkdir(parents=True, exist_ok=True)
    entries: list[Entry] = []
    for split, recordings in (("train", train), ("test", test)):
        for recording in recordings:
            entry = entry_of(recording, split)
            check_entry(entry, str(path / FILE_NAME))
            file = path / entry["file"]
            file.parent.mkdir(parents=True, exist_ok=True)
            write_csv(file, recording)
            entries.append(entry)
    write_toml(path / FILE_NAME, {}, recordings=entries)


def list_recording(
    path: Path,
    file: str,
    *,
    bench: str,
    split: str,
    start: str = "equilibrium",
    load_cell_rate: float | None = None,
) -> None:
    """Add a recording that was written to a folder to its ``dataset.toml``, whole or not at all.

    Args:
        bench: Name under ``assets/`` of the bench that was measured.
        split: ``train`` or ``test``.
        start: State from which a simulation starts.
        load_cell_rate: Rate of the load cell where it is slower than the rows [Hz].
    """
    entry: Entry = {"file": file, "bench": bench, "split": split}
    if start != "equilibrium":
        entry["start"] = start
    if load_cell_rate is not None:
        entry["load_cell_rate"] = load_cell_rate
    check_entry(entry, str(path / FILE_NAME))
    write_toml(path / FILE_NAME, {}, recordings=[*listed_recordings(path), entry])


def listed_recordings(path: Path) -> list[Entry]:
    """Read the entries of a folder, none where it is no dataset yet."""
    return read_entries(path) if (path / FILE_NAME).exists() else []


def listed_files(path: Path) -> tuple[str, ...]:
    """Return the recordings that a folder lists, none where it is no dataset yet."""
    return tuple(entry["file"] for entry in listed_recordings(path))


def read_entries(path: Path) -> list[Entry]:
    """Read and check ``dataset.toml`` without opening the recordings."""
    where = path / FILE_NAME
    if os.path.isdir(path) and not where.exists():  # noqa: PTH112 - takes names of no file
        refuse_other_folder(path)
    table = read_toml(where, InvalidDataset, f"a dataset is a folder with {FILE_NAME}")
    refuse_unknown_keys(table, ("recordings",), str(where), InvalidDataset)
    entries = table.get("recordings", [])
    if not are_tables(entries):
        raise InvalidDataset(f"{where}: recordings must be an array of tables, [[recordings]]")
    if not entries:
        raise InvalidDataset(f"{where}: a dataset lists one [[recordings]] or more; it lists none")
    for index, entry in enumerate(entries):
        check_entry(entry, f"{where}: [[recordings]] {index}")
    for file, count in Counter(os.path.normpath(entry["file"]) for entry in entries).items():
        if count > 1:
            raise InvalidDataset(
                f"{where}: a recording belongs to one split and is listed once; "
                f"{file!r} is listed {count} times"
            )
    return entries


def dataset_folders(path: Path) -> tuple[Path, ...]:
    """Return the datasets inside a folder that is none itself, by name."""
    if (path / FILE_NAME).is_file():
        return ()
    return tuple(sorted(file.parent for file in path.glob(f"*/{FILE_NAME}")))


def refuse_other_folder(path: Path) -> None:
    """Refuse a folder of datasets, of logs, or of LeRobot with the commands that take it."""
    if parts := dataset_folders(path):
        command = ["tendon-newton", "diagnose", f"{path}", "--out", f"{path}_diagnosis"]
        raise InvalidDataset(
            f"{path}: a dataset is a folder with {FILE_NAME}; this one holds {len(parts)} such "
            f"folders: {listed(part.name for part in parts)}. Name one of them; all at once are "
            f"taken by {shlex.join(command)}"
        )
    if (path / "meta" / "info.json").is_file():
        command = shlex.join(["tendon-newton", "import", "lerobot", f"{path}", "--out", "arm"])
        raise InvalidDataset(f"{path}: is a LeRobotDataset, to be imported first: {command}")
    if log := next((file for file in path.iterdir() if file.suffix in LOG_SUFFIXES), None):
        words = ["tendon-newton", "import", "mapped", f"{path}", "--mapping", "mapping.toml"]
        raise InvalidDataset(
            f"{path}: a dataset is a folder with {FILE_NAME}; this one holds logs ({log.name}), to "
            f"be imported first: {shlex.join([*words, '--out', 'dataset'])} (docs/your_logs.md)"
        )


def check_entry(entry: Entry, where: str) -> None:
    """Refuse an entry with missing, unknown or mistyped keys."""
    refuse_unknown_keys(entry, KEY_TYPES, where, InvalidDataset)
    for key in REQUIRED_KEYS:
        if key not in entry:
            raise InvalidDataset(f"{where}: key {key!r} is missing; there are {listed(entry)}")
    where = f"{where} ({shown(entry['file'])})"
    for key, value in entry.items():
        types, words = KEY_TYPES[key]
        if not isinstance(value, types) or isinstance(value, bool):
            raise InvalidDataset(f"{where}: {key} must be {words}; it is {shown(value)}")
    if entry["split"] not in SPLITS:
        raise InvalidDataset(
            f"{where}: split must be 'train' or 'test'; it is {shown(entry['split'])}"
        )
    for key in ("file", "mapping"):
        if key in entry:
            check_path(entry[key], f"{where}: {key}", InvalidDataset)


def inside(folder: Path, name: str, where: str) -> Path:
    """Return a file of a dataset; one that links lead out of its folder is not opened."""
    path = folder / name
    try:
        home, real = os.path.realpath(folder), os.path.realpath(path)
    except (OSError, ValueError):  # such as a name that is too long: opening it says so
        return path
    if os.path.commonpath((home, real)) != home:
        raise InvalidDataset(
            f"{where}: a file must lie inside the dataset's folder; {shown(name)} is a link that "
            "leads out of it: copy the file"
        )
    return path


def read_recording(path: Path, entry: Entry) -> Recording:
    """Read the recording that an entry lists."""
    name = entry["file"]
    where = f"{path / FILE_NAME}: {name}"
    file = inside(path, name, where)
    try:
        overrides = read_bench_overrides(entry.get("bench_overrides", {}))
    except TendonNewtonError as error:
        raise InvalidDataset(f"{where}: {error}") from error
    start: Literal["equilibrium", "first_row"] = entry.get("start", "equilibrium")
    stated = CheckedTable({"actuator_overrides": {}, **entry}, where, InvalidDataset)
    more = {key: entry[key] for key in ("obstacle",) if key in entry}
    if "load_cell_rate" in entry:
        more["load_cell_rate"] = stated.number("load_cell_rate")
    try:
        with kept_inside(path):
            if "mapping" in entry:
                more["mapping"] = read_topic_mapping(inside(path, entry["mapping"], where))
            return read_recording_file(
                file,
                name=name,
                bench=entry["bench"],
                start=start,
                bench_overrides=overrides,
                actuator_overrides=stated.numbers("actuator_overrides"),
                **more,
            )
    except OSError as error:
        raise InvalidDataset(f"{where}: cannot be read: {error.strerror or error}") from error


def entry_of(recording: Recording, split: str) -> Entry:
    """Make the ``[[recordings]]`` table of a recording; defaults are left out."""
    file = Path(recording.name)
    name = file.with_suffix(".csv") if file.suffix in (".mcap", ".db3") else file
    entry: Entry = {"file": name.as_posix(), "bench": recording.bench, "split": split}
    if recording.start != "equilibrium":
        entry["start"] = recording.start
    if overrides := write_bench_overrides(recording.bench_overrides):
        entry["bench_overrides"] = overrides
    if recording.actuator_overrides:
        entry["actuator_overrides"] = dict(recording.actuator_overrides)
    if recording.load_cell_rate is not None:
        entry["load_cell_rate"] = recording.load_cell_rate
    if recording.obstacle != FREE:
        entry["obstacle"] = recording.obstacle
    return entry
