"""Datasets of our own format, read so that one recording that is none hides no other."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tendon_newton.data.checks.bench_checks import BenchFacts
from tendon_newton.data.checks.finding import Examined, Finding
from tendon_newton.data.checks.lint import lint_dataset, lint_recording, mended
from tendon_newton.data.dataset import (
    FILE_NAME,
    ListedRecording,
    inside,
    read_entries,
    read_recording,
    write_dataset,
)
from tendon_newton.data.formats.csv_columns import read_columns
from tendon_newton.data.formats.csv_file import recording_of
from tendon_newton.data.importers.column_mends import mended_columns, names_of_parts
from tendon_newton.data.recording import Recording
from tendon_newton.errors import InvalidOutput, TendonNewtonError


@dataclass(frozen=True, kw_only=True)
class OwnDataset:
    """What a folder holds."""

    train: tuple[Recording, ...]
    test: tuple[Recording, ...]
    findings: tuple[Finding, ...]  # What is wrong, and which recordings are none


def read_own(
    folder: Path,
    known_bench: Callable[[Recording], BenchFacts | None] = lambda _: None,
    *,
    mend: bool = False,
) -> OwnDataset:
    """Read every recording of a folder that is one, and look at them all.

    Args:
        known_bench: Gives what is known of a recording's bench; None where nothing is.
        mend: Whether to mend what no reader would mend otherwise.

    Raises:
        InvalidDataset: There is no ``dataset.toml``, or it is none.
        InvalidRecording: No recording of it can be read.
    """
    split: dict[str, list[Recording]] = {"train": [], "test": []}
    told: list[Finding] = []
    fault: TendonNewtonError | None = None
    for entry in read_entries(folder):
        try:
            recordings, found = read_listed(folder, entry, mend=mend)
        except TendonNewtonError as error:
            fault = error
            told.append(
                Examined(entry.file, "all").defect(
                    str(error).removeprefix(f"{entry.file}: "), "this recording is none: mend it"
                )
            )
            continue
        split[entry.split] += recordings
        told += found
        told += [one for r in recordings for one in lint_recording(r, bench=known_bench(r))]
    train, test = tuple(split["train"]), tuple(split["test"])
    if fault is not None and not (train or test):
        raise fault
    return OwnDataset(train=train, test=test, findings=(*told, *lint_dataset(train, test)))


def read_listed(
    folder: Path, entry: ListedRecording, *, mend: bool
) -> tuple[Sequence[Recording], Sequence[Finding]]:
    """Read the recording that an entry lists, in parts where its clock begins again."""
    if not mend or not entry.file.endswith(".csv"):
        recording, found = read_recording(folder, entry), ()
        if mend:
            recording, found = mended(recording)
        return [recording], found
    columns = read_columns(inside(folder, entry.file, str(folder / FILE_NAME)), entry.file)
    numbers = {n: v for n, v in columns.items() if np.issubdtype(v.dtype, np.number)}
    parts, told = mended_columns(numbers, entry.file)
    if len(parts) == 1:
        parts = [{**columns, **parts[0]}] if len(parts[0]["t"]) == len(columns["t"]) else parts
    passed = [
        mended(recording_of(dict(part), name=name, **entry.stated))
        for name, part in zip(names_of_parts(entry.file, len(parts)), parts, strict=True)
    ]
    return [own for own, _ in passed], [*told, *(one for _, found in passed for one in found)]


def write_mended(folder: Path, dataset: OwnDataset, out: Path) -> None:
    """Write a mended dataset, with the model that lies beside the recordings."""
    if (out / FILE_NAME).exists():
        raise InvalidOutput(f"{out}: --mend needs a new folder; this one holds a dataset")
    write_dataset(out, dataset.train, dataset.test)
    model = folder / "model.toml"
    if model.is_file():
        (out / model.name).write_bytes(model.read_bytes())
