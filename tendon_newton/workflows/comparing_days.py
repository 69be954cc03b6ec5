"""Hold days against an earlier one, and write what changed."""

from collections.abc import Callable, Collection, Mapping
from dataclasses import replace
from pathlib import Path

from tendon_newton.data.dataset import FILE_NAME, Dataset, dataset_folders, load_dataset
from tendon_newton.data.files.output_folder import make_folder
from tendon_newton.data.files.text_file import inside
from tendon_newton.data.files.together import together
from tendon_newton.data.model_file import Model, load_model, write_model
from tendon_newton.diagnosis.accounts.checked_data import sound
from tendon_newton.diagnosis.diagnosed_bench import recorded_benches
from tendon_newton.diagnosis.diagnosis_file import ANSWER, MODEL, read_diagnosis
from tendon_newton.diagnosis.in_time.changes import Changes, EarlierDay, find_changes, study_day
from tendon_newton.diagnosis.in_time.changes_report import write_changes
from tendon_newton.diagnosis.in_time.log_events import CalmDay, calm_day, find_events
from tendon_newton.diagnosis.unblocked import free
from tendon_newton.errors import (
    InvalidDataset,
    InvalidModelFile,
    InvalidOutput,
    InvalidParameter,
    listed,
)


def compare_days(
    new: Path,
    against: Path,
    model: Path | None,
    progress: Callable[[str], None],
    out: Path | None = None,
    mended: Collection[str] = (),
) -> Mapping[str, Changes]:
    """Say what changed since a day.

    Training recordings decide. Events are looked for in test recordings, too, where the earlier
    day's recordings are there to tell them from what its model leaves.

    Args:
        new: A dataset, one recording of it, or a folder of datasets that are days, in the order of
            their names.
        against: Dataset of an earlier day, or the folder or file of its diagnosis.
        model: Model file of the earlier day; that of the diagnosis, or beside the recordings, by
            default.
        out: Folder of the results, ``model.toml`` of the last day among them; made if it is not
            there. By default nothing is written.
        mended: Causes that somebody mended in between.

    Raises:
        TendonNewtonError: Something cannot be read or used; the message says why.
    """
    if out is not None and (out / ANSWER).is_file():
        raise InvalidOutput(f"{out}: holds a diagnosis; what changed goes into a folder of its own")
    against = against.parent if against.name == ANSWER else against
    if against.resolve() in (folder.resolve() for folder in days_in(new)):
        raise InvalidParameter(
            f"{new}: a day is held against another one; --against names the same"
        )
    days = {folder.name: day_of(folder) for folder in days_in(new)}
    known = earlier_model(against, model)
    calm: CalmDay | None = None
    if (against / ANSWER).is_file():
        refuse_other_benches(days, recorded_benches(against), against)
        first = stated_day(against, known)
    else:
        recordings = day_of(against).train
        refuse_other_benches(days, [recording.bench for recording in recordings], against)
        progress("looking for what the model lacks on the first day")
        first = study_day(recordings, known)
        calm = calm_day(recordings, first.model)
    found: dict[str, Changes] = {}
    for name, day in days.items():
        if len(days) > 1:
            progress(f"day {name}")
        changes = find_changes(first, day.train, unseen=day.test, mended=mended, progress=progress)
        if calm is not None:
            progress("looking for events")
            events = find_events(calm, sound((*day.train, *day.test)), changes.model)
            changes = replace(changes, events=events)
        found[name] = changes
    if out is not None:
        with together():
            write_model(make_folder(out) / MODEL, list(found.values())[-1].model)
            write_changes(out, found, str(against))
    return found


def days_in(path: Path) -> tuple[Path, ...]:
    """Return the datasets of a folder: itself, or those in it by name; a recording is a day too."""
    if path.is_file() or (path / FILE_NAME).is_file():
        return (path,)
    days = dataset_folders(path)
    if not days:
        raise InvalidDataset(
            f"{path}: days are a dataset, or a folder of datasets; here is neither {FILE_NAME} nor "
            f"a folder with one"
        )
    return days


def day_of(path: Path) -> Dataset:
    """Return a day, or one recording of it, without those in which something is in the way."""
    folder = path.parent if path.is_file() else path
    day = load_dataset(folder, require_train=folder == path, require_test=False)
    if folder != path:
        own = tuple(r for r in (*day.train, *day.test) if r.name == path.name)
        day = replace(day, train=own, test=())
        if not own:
            raise InvalidDataset(f"{path}: {folder / FILE_NAME} must list it; it does not")
    return replace(day, train=free(day.train), test=free(day.test))


def earlier_model(path: Path, stated: Path | None) -> Model:
    """Return the model of the earlier day."""
    if not any((path / name).is_file() for name in (ANSWER, FILE_NAME)):
        raise InvalidDataset(
            f"{path}: an earlier day is a dataset or the folder of a diagnosis; here is neither "
            f"{FILE_NAME} nor {ANSWER}{inside(path / ANSWER)}"
        )
    file = stated or path / MODEL
    if not file.is_file():
        raise InvalidModelFile(f"{file}: days are compared by a model; name one with --model")
    return load_model(file)


def stated_day(path: Path, model: Model) -> EarlierDay:
    """Return what a diagnosis says of the earlier day."""
    said = read_diagnosis(path / ANSWER)
    numbers = {cause.name: cause.parameters for cause in (*said.effects, *said.suspected)}
    estimates = {model.actuator.name: said.fitted, **numbers}
    return EarlierDay(model=model, estimates=estimates, usual=said.extended)


def refuse_other_benches(
    days: Mapping[str, Dataset], benches: Collection[str], against: Path
) -> None:
    """Refuse days of a bench that the earlier day does not have; an answer may not say its own."""
    own = {Path(bench).stem for bench in benches}
    for name, day in days.items():
        other = {Path(recording.bench).stem for recording in day.train} - own
        if own and other:
            raise InvalidDataset(
                f"{name}: a day is held against an earlier one of its own bench; {against} is of "
                f"{listed(own)}, this day of {listed(other)}: diagnose it without --against"
            )
