"""Diagnose a dataset, or hold days against an earlier one, and write all files of the answer."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from tendon_newton.data.dataset import FILE_NAME, Dataset, load_dataset
from tendon_newton.data.files.text_file import make_folder
from tendon_newton.data.model_file import Model, load_model, write_model
from tendon_newton.data.recording import Recording
from tendon_newton.diagnosis.diagnose import diagnose
from tendon_newton.diagnosis.diagnosis_file import read_diagnosis
from tendon_newton.diagnosis.identified import write_identified
from tendon_newton.diagnosis.in_time.changes import Changes, find_changes
from tendon_newton.diagnosis.in_time.changes_report import write_changes
from tendon_newton.diagnosis.in_time.log_events import find_events
from tendon_newton.diagnosis.reporting.report import Origin, write_report
from tendon_newton.diagnosis.result import Diagnosis, Errors, Estimate, write_diagnosis
from tendon_newton.diagnosis.unblocked import free
from tendon_newton.errors import InvalidDataset, InvalidModelFile

ANSWER = "diagnosis.json"


@dataclass(frozen=True, kw_only=True)
class DiagnosisAnswer:
    """A diagnosis and where it was written."""

    diagnosis: Diagnosis
    layers: tuple[Path, ...]
    """USD layers of what was found about the mechanisms."""


def diagnose_into(
    out: Path,
    dataset: Dataset,
    model: Model,
    origin: Origin,
    *,
    progress: Callable[[str], None],
    budget: float | None = None,
) -> DiagnosisAnswer:
    """Diagnose, and write ``diagnosis.json`` last: where it stands, all else stands.

    Args:
        out: Folder of the results; made if it is not there.
        dataset: Training recordings decide, test recordings only report.
        model: The model to start from.
        origin: Where the recordings are from, for the report.
        progress: Told what is being done.
        budget: Time that it may take, about [s].
    """
    make_folder(out)
    diagnosis, evidence = diagnose(dataset, model, progress=progress, budget=budget)
    write_model(out / "model.toml", diagnosis.model)
    write_report(out / "report.html", diagnosis, evidence, origin)
    layers = write_identified(out, diagnosis, dataset)
    write_diagnosis(out / ANSWER, diagnosis)
    return DiagnosisAnswer(diagnosis=diagnosis, layers=layers)


def compare_days(
    new: Path, against: Path, out: Path, model: Path | None, progress: Callable[[str], None]
) -> Mapping[str, Changes]:
    """Say what changed since a day, and write ``model.toml`` of the last one.

    Training recordings decide, test recordings only report. Events are looked for in both, where
    the earlier day's recordings are there to tell them from what its model leaves.

    Args:
        new: A dataset, or a folder of datasets that are days, in the order of their names.
        against: Dataset of an earlier day, or the folder of its diagnosis.
        out: Folder of the results; made if it is not there.
        model: Model file of the earlier day; that of the diagnosis, or beside the recordings, by
            default.
        progress: Told what is being done.

    Raises:
        TendonNewtonError: Something cannot be read or used; the message says why.
    """
    folders = days_in(new)
    first, known, usual = earlier_day(against, model)
    found: dict[str, Changes] = {}
    for folder in folders:
        if len(folders) > 1:
            progress(f"day {folder.name}")
        day = day_of(folder)
        changes = find_changes(
            first, day.train, known, unseen=day.test, usual=usual, progress=progress
        )
        if not isinstance(first, Mapping):
            progress("looking for events")
            runs = (*day.train, *day.test)
            events = find_events(first, runs, changes.earlier, now=changes.model)
            changes = replace(changes, events=events)
        found[folder.name] = changes
    write_changes(make_folder(out), found, str(against))
    write_model(out / "model.toml", found[folders[-1].name].model)
    return found


def days_in(path: Path) -> list[Path]:
    """Return the datasets of a folder: itself, or those in it by name."""
    if (path / FILE_NAME).is_file():
        return [path]
    days = sorted(file.parent for file in path.glob(f"*/{FILE_NAME}"))
    if not days:
        raise InvalidDataset(
            f"{path}: days are a dataset, or a folder of datasets; here is neither {FILE_NAME} nor "
            f"a folder with one"
        )
    return days


def day_of(folder: Path) -> Dataset:
    """Return a day without recordings in which something is in the way."""
    day = load_dataset(folder, require_test=False)
    return replace(day, train=free(day.train), test=free(day.test))


def earlier_day(
    path: Path, model: Path | None
) -> tuple[tuple[Recording, ...] | Mapping[str, Mapping[str, Estimate]], Model, Errors | None]:
    """Return what is known of the earlier day, its model, and how much that is known to err."""
    if (path / ANSWER).is_file():
        known = load_model(model or path / "model.toml")
        said = read_diagnosis(path / ANSWER)
        numbers = {cause.name: cause.parameters for cause in (*said.effects, *said.suspected)}
        return {known.actuator.name: said.fitted, **numbers}, known, said.extended
    if not (path / FILE_NAME).is_file():
        raise InvalidDataset(
            f"{path}: an earlier day is a dataset or the folder of a diagnosis; here is neither "
            f"{FILE_NAME} nor {ANSWER}"
        )
    file = model or path / "model.toml"
    if not file.is_file():
        raise InvalidModelFile(f"{file}: days are compared by a model; name one with --model")
    return day_of(path).train, load_model(file), None
