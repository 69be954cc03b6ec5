"""A dataset: a folder of recordings with ``dataset.toml``, split by recording."""

import logging
import os.path
import shlex
import signal
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, fields
from functools import partial
from logging.handlers import BufferingHandler
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypeVar

from tendon_newton.data.bench_overrides import (
    BenchOverrides,
    read_bench_overrides,
    write_bench_overrides,
)
from tendon_newton.data.files.checked_table import CheckedTable, table_of
from tendon_newton.data.files.file_names import check_path
from tendon_newton.data.files.html_table import html_table
from tendon_newton.data.files.text_file import kept_inside
from tendon_newton.data.files.together import together
from tendon_newton.data.files.toml_file import read_toml, refuse_unknown_keys, write_toml
from tendon_newton.data.files.values import are_tables
from tendon_newton.data.formats.any_file import read_recording_file
from tendon_newton.data.formats.csv_file import write_csv
from tendon_newton.data.formats.mapped_column import read_topic_mapping
from tendon_newton.data.formats.rosbag import METADATA_FILE
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
Split = Literal["train", "test"]
SPLITS: tuple[Split, ...] = ("train", "test")
LOG_SUFFIXES = (
    ".csv", ".json", ".jsonl", ".ndjson", ".mcap", ".db3", ".txt", ".tsv", ".dat", ".log", ".xlsx"
)  # fmt: skip
"""Endings of logs that a mapping explains."""


@dataclass(frozen=True, kw_only=True)
class ListedRecording:
    """One ``[[recordings]]`` table of ``dataset.toml``."""

    file: str  # Its path inside the dataset's folder
    bench: str  # Name or USD file of the bench that was measured
    split: Split
    mapping: str | None = None  # Path of a mapping file inside the folder, for logs of messages
    start: Literal["equilibrium", "first_row"] = "equilibrium"  # State in which a simulation starts
    obstacle: str | None = None  # What stands in the way, where the file does not say
    load_cell_rate: float | None = None  # Of a cell that is slower than the rows [Hz]
    current_in: Literal["winding"] | None = None  # Where the current flows, if not in the supply
    bench_overrides: BenchOverrides = field(default_factory=BenchOverrides)
    actuator_overrides: Mapping[str, float] = field(default_factory=dict[str, float])

    @property
    def stated(self) -> dict[str, Any]:
        """What it says of the recording, as that one's fields."""
        own = {f.name: getattr(self, f.name) for f in fields(self)}
        return {
            name: value
            for name, value in own.items()
            if name not in ("file", "split", "mapping") and value is not None
        }


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
        jobs: Processes at most that read large files of messages side by side. Each is a fresh
            interpreter, so a script that asks for them needs ``if __name__ == "__main__"``.
    """
    path = Path(path)
    where = path / FILE_NAME
    entries = read_entries(path)
    counts = {split: sum(entry.split == split for entry in entries) for split in SPLITS}
    if require_train and not counts["train"]:
        raise InvalidDataset(
            f'{where}: some recording must have split = "train", to fit the model on; '
            f'all {counts["test"]} have split = "test"'
        )
    if require_test and not counts["test"]:
        raise InvalidDataset(
            f'{where}: some recording must have split = "test", to report errors on data that '
            f'no fit has seen; all {counts["train"]} have split = "train": '
            'give at least one whole recording split = "test", or diagnose with --hold-out 0.3'
        )
    begun = stamps(path, entries)
    processes = process_count([path / entry.file for entry in entries], jobs)
    recordings = read_all(partial(read_recording, path), entries, processes)
    train, test = (
        tuple(r for r, entry in zip(recordings, entries, strict=True) if entry.split == split)
        for split in SPLITS
    )
    if stamps(path, entries) != begun:
        raise InvalidDataset(f"{path}: recordings must stay as they are while they are read")
    return Dataset(path=path, train=train, test=test)


def stamps(path: Path, entries: Sequence[ListedRecording]) -> list[tuple[int, int]]:
    """Return when each file of a dataset was changed, and how long it is."""
    states = [file.stat() for file in all_files(path, entries)]
    return [(state.st_mtime_ns, state.st_size) for state in states]


def all_files(path: Path, entries: Sequence[ListedRecording]) -> list[Path]:
    """Return the files of a dataset: its list, recordings, which may be folders, and mappings."""
    names = [name for entry in entries for name in (entry.file, entry.mapping) if name]
    own = [inside(path, name, str(path / FILE_NAME)) for name in dict.fromkeys(names)]
    named = [path / FILE_NAME, *own]
    files: list[Path] = []
    for name in named:
        with suppress(OSError):  # whoever reads it says what is wrong with it
            files += [f for f in sorted(name.rglob("*")) or [name] if f.is_file()]
    return files


def load_recording(file: Path, bench: str = "finger") -> Recording:
    """Read one recording: as the dataset in its folder lists it, else as one of a bench."""
    for entry in listed_recordings(file.parent):
        if os.path.normpath(entry.file) == file.name:
            return read_recording(file.parent, entry)
    return read_recording_file(file, bench=bench, name=file.name)


def write_dataset(path: Path, train: Sequence[Recording], test: Sequence[Recording]) -> None:
    """Write recordings as CSV and the ``dataset.toml`` that lists them, all of them or none."""
    path.mkdir(parents=True, exist_ok=True)
    entries: list[ListedRecording] = []
    with together():
        for split, recordings in zip(SPLITS, (train, test), strict=True):
            for recording in recordings:
                entry = entry_of(recording, split)
                check_path(entry.file, f"{path / FILE_NAME}: file", InvalidDataset)
                file = path / entry.file
                file.parent.mkdir(parents=True, exist_ok=True)
                write_csv(file, recording)
                entries.append(entry)
        write_entries(path, entries)


def list_recording(path: Path, entry: ListedRecording) -> None:
    """Add a recording that was written to a folder to its ``dataset.toml``, whole or not at all.

    One of the same name was deleted, and was made anew.
    """
    others = [other for other in listed_recordings(path) if other.file != entry.file]
    write_entries(path, [*others, entry])


def write_entries(path: Path, entries: Sequence[ListedRecording]) -> None:
    """Write the ``dataset.toml`` of a folder; defaults are left out."""
    rows = [
        table_of(entry) | {"bench_overrides": write_bench_overrides(entry.bench_overrides)}
        for entry in entries
    ]
    rows = [{key: value for key, value in row.items() if value != {}} for row in rows]
    write_toml(path / FILE_NAME, {}, recordings=rows)


def listed_recordings(path: Path) -> list[ListedRecording]:
    """Read the entries of a folder, none where it is no dataset yet."""
    return read_entries(path) if (path / FILE_NAME).exists() else []


def listed_files(path: Path) -> tuple[str, ...]:
    """Return the recordings that a folder lists, none where it is no dataset yet."""
    return tuple(entry.file for entry in listed_recordings(path))


def read_entries(path: Path) -> list[ListedRecording]:
    """Read and check ``dataset.toml`` without opening the recordings."""
    where = path / FILE_NAME
    if os.path.exists(path) and not where.exists():  # noqa: PTH110 - takes names of no file
        refuse_other_folder(path)
    table = read_toml(where, InvalidDataset, f"a dataset is a folder with {FILE_NAME}")
    refuse_unknown_keys(table, ("recordings",), str(where), InvalidDataset)
    rows = table.get("recordings", [])
    if not are_tables(rows):
        raise InvalidDataset(f"{where}: recordings must be an array of tables, [[recordings]]")
    if not rows:
        raise InvalidDataset(f"{where}: a dataset lists one [[recordings]] or more; it lists none")
    entries = [read_entry(row, f"{where}: [[recordings]] {k}") for k, row in enumerate(rows)]
    for file, count in Counter(os.path.normpath(entry.file) for entry in entries).items():
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
    """Refuse a log, or a folder of datasets, logs, a diagnosis or LeRobot, with what takes it."""
    if parts := dataset_folders(path):
        command = ["tendon-newton", "diagnose", f"{path}", "--out", f"{path}_diagnosis"]
        raise InvalidDataset(
            f"{path}: a dataset is a folder with {FILE_NAME}; this one holds {len(parts)} such "
            f"folders: {listed(part.name for part in parts)}. Name one of them; all at once are "
            f"taken by {shlex.join(command)}"
        )
    if (path / "diagnosis.json").is_file():
        raise InvalidDataset(
            f"{path}: a dataset is a folder with {FILE_NAME}; this one holds a diagnosis: name the "
            f"dataset that it was made of. Why its causes were named is told by "
            f"{shlex.join(['tendon-newton', 'explain', f'{path}'])}"
        )
    if found := sorted(file.parent.name for file in path.glob("*/diagnosis.json")):
        raise InvalidDataset(
            f"{path}: a dataset is a folder with {FILE_NAME}; this one holds the diagnoses of "
            f"{listed(found)}: name the dataset that they were made of"
        )
    refuse_lerobot(path)
    folder, files = (path, path.iterdir()) if path.is_dir() else (path.parent, [path])
    logs = (
        file
        for file in files
        if (file.suffix in LOG_SUFFIXES and file.is_file()) or (file / METADATA_FILE).is_file()
    )
    if log := next(logs, None):
        words = ["tendon-newton", "import", "mapped", f"{folder}", "--mapping", "mapping.toml"]
        came = f"this one holds logs ({log.name})" if folder == path else "this is a log"
        raise InvalidDataset(
            f"{path}: a dataset is a folder with {FILE_NAME}; {came}, to be imported first: "
            f"{shlex.join([*words, '--out', 'dataset'])} (docs/your_logs.md)"
        )


def refuse_lerobot(path: Path) -> None:
    """Refuse a LeRobotDataset, with what takes it."""
    if (path / "meta" / "info.json").is_file():
        command = shlex.join(["tendon-newton", "diagnose", f"{path}", "--out", "arm_diagnosis"])
        raise InvalidDataset(
            f"{path}: is a LeRobotDataset, which {command} takes as it is, or import it first with "
            f"{shlex.join(['tendon-newton', 'import', 'lerobot', f'{path}', '--out', 'arm'])}"
        )


def refuse_own(path: Path) -> None:
    """Refuse a dataset of ours where another format is to be imported."""
    if (path / FILE_NAME).is_file():
        command = shlex.join(["tendon-newton", "diagnose", f"{path}", "--out", f"{path}_diagnosis"])
        raise InvalidDataset(f"{path}: is a dataset of ours already: {command}")


def read_entry(row: dict[str, Any], where: str) -> ListedRecording:
    """Read one of the ``[[recordings]]`` tables."""
    known = [field.name for field in fields(ListedRecording)]
    refuse_unknown_keys(row, known, where, InvalidDataset)
    where = f"{where} ({shown(row.get('file'))})"
    try:
        overrides = read_bench_overrides(row.get("bench_overrides", {}))
    except TendonNewtonError as error:
        raise InvalidDataset(f"{where}: {error}") from error
    table = CheckedTable(row, where, InvalidDataset)
    entry = table.record(ListedRecording, bench_overrides=overrides)
    for key, path in (("file", entry.file), ("mapping", entry.mapping)):
        if path is not None:
            check_path(path, f"{where}: {key}", InvalidDataset)
    return entry


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


def read_recording(path: Path, entry: ListedRecording) -> Recording:
    """Read the recording that an entry lists."""
    where = f"{path / FILE_NAME}: {entry.file}"
    stated = entry.stated
    try:
        with kept_inside(path):
            if entry.mapping is not None:
                stated["mapping"] = read_topic_mapping(inside(path, entry.mapping, where))
            return read_recording_file(inside(path, entry.file, where), name=entry.file, **stated)
    except OSError as error:
        raise InvalidDataset(f"{where}: cannot be read: {error.strerror or error}") from error


def entry_of(recording: Recording, split: Split) -> ListedRecording:
    """Make the ``[[recordings]]`` table of a recording."""
    file = Path(recording.name)
    return ListedRecording(
        file=(file.with_suffix(".csv") if file.suffix in MESSAGE_FILES else file).as_posix(),
        split=split,
        bench=recording.bench,
        start=recording.start,
        obstacle=None if recording.obstacle == FREE else recording.obstacle,
        load_cell_rate=recording.load_cell_rate,
        current_in=recording.current_in,
        bench_overrides=recording.bench_overrides,
        actuator_overrides=recording.actuator_overrides,
    )
