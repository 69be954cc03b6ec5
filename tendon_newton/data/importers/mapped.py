"""Anybody's CSV, JSON and ROS 2 logs, by a mapping file (see ``docs/recordings_mapping.md``)."""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from fnmatch import fnmatchcase
from pathlib import Path

import numpy as np

from tendon_newton.data.checks.command_checks import exchanges
from tendon_newton.data.checks.finding import Examined, Finding
from tendon_newton.data.checks.mends import without_failed_reads
from tendon_newton.data.checks.read_checks import neighbours_reads
from tendon_newton.data.dataset import LOG_SUFFIXES, refuse_lerobot, refuse_own
from tendon_newton.data.files.checked_table import CheckedTable
from tendon_newton.data.files.origin import file_hash
from tendon_newton.data.formats.any_file import read_recording_file
from tendon_newton.data.formats.csv_file import SHARED_COLUMNS, TENDON_COLUMNS, recording_of
from tendon_newton.data.formats.rosbag import METADATA_FILE
from tendon_newton.data.importers.column_mapping import ColumnMapping, read_mapping
from tendon_newton.data.importers.column_mends import mended_columns, names_of_parts
from tendon_newton.data.importers.imported import Imported, ImportedLog
from tendon_newton.data.importers.mapped_rows import PLACE, place_word, read_mapped_columns
from tendon_newton.data.model_file import Model, NamedValues, read_named
from tendon_newton.data.recording import SERVO, Array, Recording
from tendon_newton.errors import InvalidMapping, InvalidRecording, TendonNewtonError, listed, shown

NOMINAL_GAIN = 4.2  # Force of the paper's servo per angle [N/rad], where a mapping states no model
LEADS = "measured_path"  # Actuator to which the shaft's path is given
SAVED_BY = 'save it as CSV there (File, Save As, "CSV UTF-8"), one run a file'
TO_CSV = "write it as CSV, with pandas by DataFrame.to_csv"
FOREIGN: Mapping[str, str] = {
    **dict.fromkeys((".xlsx", ".xls", ".xlsm", ".ods"), f"this is a spreadsheet: {SAVED_BY}"),
    **dict.fromkeys((".gz", ".zip", ".xz", ".bz2", ".7z"), "this one is packed: unpack it"),
    **dict.fromkeys((".parquet", ".feather", ".h5", ".hdf5"), f"this is a table: {TO_CSV}"),
    **dict.fromkeys((".pkl", ".pickle"), f"this is a Python object: {TO_CSV}"),
    **dict.fromkeys((".npz", ".npy"), "these are arrays of numpy: write them by numpy.savetxt"),
    ".mat": "this is MATLAB's: write it as CSV there by writetable",
    ".bag": "this is a bag of ROS 1: make one of ROS 2 of it by rosbags-convert",
}
"""Suffix of a file that is no log here -> what it is, and how it becomes one."""
SAME_RADIUS = 1e-3  # Share by which two files may round a radius [1]
ROS_SUFFIXES = (".mcap", ".db3")
"""Files of ROS 2 recordings; a folder with ``metadata.yaml`` is one as well."""


def read_mapped(
    folder: Path, mapping_file: Path, spool_radius: Callable[[str], float], *, mend: bool = False
) -> Imported:
    """Read every log of a folder that a mapping file's pattern matches.

    Args:
        spool_radius: Gives the radius [m] that a bench's asset states, by the bench's name.
        mend: Whether to mend what else makes no recording: lost signs, a clock that begins again.
    """
    if not folder.is_dir():
        came = "no such folder"
        if folder.exists():
            came = f"it is a file: name {folder.parent}, and files = {folder.name!r} in the mapping"
        raise InvalidRecording(f"{folder}: logs come as a folder; {came}")
    refuse_own(folder)
    refuse_lerobot(folder)
    mapping = read_mapping(mapping_file)
    paths = find_logs(folder, mapping)
    for part in mapping.stated:
        if not any(fnmatchcase(path.name, part.pattern) for path in paths):
            raise InvalidMapping(f"{mapping.path}: no log matches logs.{part.pattern!r}")
    read = [read_log(folder, path, mapping, mend=mend) for path in paths]
    model = start_model(mapping, spool_radius)
    imported = Imported(
        logs=tuple(
            led(log) if model.actuator.name == LEADS else log for logs, _ in read for log in logs
        ),
        start_model=lambda _: model,
        limits={},
        findings=(
            *mapped_twice(mapping),
            *no_model(mapping, [log.recording for logs, _ in read for log in logs]),
            *(one for _, found in read for one in found),
        ),
    )
    several = any(log.recording.tendon_count > 1 for log in imported.logs)
    alone = mapping.joints or (mapping.bench == SERVO and several)
    return by_joint(imported, mapping, mend=mend) if alone else imported


def led(log: ImportedLog) -> ImportedLog:
    """Return a log whose path is the input: where no load is mapped, nothing loads the joint."""
    recording = log.recording
    if recording.command is not None or recording.joint_load is not None:
        return log
    return replace(log, recording=replace(recording, joint_load=np.zeros_like(recording.time)))


def mapped_twice(mapping: ColumnMapping) -> Iterator[Finding]:
    """Say which column of theirs stands for two of ours, unless its rows say so."""
    ours: dict[str, list[str]] = {}
    for name, column in mapping.columns.items():
        if column.source is not None:
            ours.setdefault(column.source, []).append(name)
    for source, names in ours.items():
        if len(names) > 1 and not all(name.startswith("theta") for name in names):
            yield Examined("all", names[1]).defect(
                f"{source!r} is mapped as {listed(names)}",
                "one column is one quantity: map the other one's own column, or leave it out",
            )


def no_model(mapping: ColumnMapping, recordings: Sequence[Recording]) -> Iterator[Finding]:
    """Say that commands reach a servo of which nothing is stated; one of unknown load obeys."""
    commanded = any(recording.command is not None for recording in recordings)
    if commanded and mapping.bench != SERVO and "model" not in mapping.model:
        yield Examined("all", "model").caution(
            f"not stated: the paper's servo is taken, {NOMINAL_GAIN} N/rad (N m/rad of a shaft)",
            "causes are named beside this servo: state yours under [model] in the mapping "
            "(docs/your_logs.md, step 3)",
        )


def find_logs(folder: Path, mapping: ColumnMapping) -> list[Path]:
    """Return the logs of a folder, refusing what the mapping is not made for."""
    if Path(mapping.files).is_absolute() or ".." in Path(mapping.files).parts:
        raise InvalidMapping(
            f"{mapping.path}: files must be a pattern inside the folder; it is {mapping.files!r}"
        )
    try:
        found = sorted(p for p in folder.glob(mapping.files) if p.is_file() or is_ros(p))
    except (OSError, ValueError) as error:  # such as a name longer than any file's
        raise InvalidMapping(
            f"{mapping.path}: files must be a pattern of names; it is {shown(mapping.files)}"
        ) from error
    if mapping.topics is not None:
        found = [path for path in found if is_ros(path)]
    elif foreign := [path for path in found if is_ros(path)]:
        raise InvalidMapping(
            f"{mapping.path}: {foreign[0].name} is a recording of ROS 2: its columns come from a "
            "topic and a field"
        )
    there = {path: path.suffix.lower() for path in found or sorted(folder.iterdir())}
    foreign = [path for path, ending in there.items() if ending in FOREIGN]
    if foreign and {*LOG_SUFFIXES}.difference(FOREIGN).isdisjoint(there.values()):
        what = FOREIGN[foreign[0].suffix.lower()]
        raise InvalidRecording(f"{foreign[0]}: logs are CSV files, and {what}")
    if not found:
        kind = "log" if mapping.topics is None else f"ROS 2 recording ({METADATA_FILE}, .mcap)"
        raise InvalidRecording(
            f"{folder}: no {kind} matches files = {mapping.files!r}; there are "
            f"{listed(path.name for path in there)}"
        )
    return found


def is_ros(path: Path) -> bool:
    """Tell whether a path is a recording of ROS 2."""
    if path.is_dir():
        return (path / METADATA_FILE).is_file()
    return path.suffix in ROS_SUFFIXES


def start_model(mapping: ColumnMapping, spool_radius: Callable[[str], float]) -> Model:
    """Return the model that a mapping states, or the nominal one of its bench."""
    try:
        table = CheckedTable({"fit": [], "tolerances": {}, **mapping.model}, "", InvalidMapping)
        fit, tolerances = table.words("fit"), table.numbers("tolerances")
        if "model" in table:
            actuator = read_named(table.table("model"), "kind")
            model = Model(actuator=actuator, fit=fit, tolerances=tolerances)
            refuse_other_radius(mapping, model, spool_radius)
            return model
        plain = NamedValues(name="ideal_position", values={})
        if mapping.bench != SERVO:
            values = {"gain": NOMINAL_GAIN, "spool_radius": spool_radius(mapping.bench)}
            plain = NamedValues(name="ideal", values=values)
        return Model(actuator=plain, fit=fit, tolerances=tolerances)
    except TendonNewtonError as error:
        raise InvalidMapping(f"{mapping.path}: {error}") from error


def refuse_other_radius(
    mapping: ColumnMapping, model: Model, spool_radius: Callable[[str], float]
) -> None:
    """Refuse a spool that mapping and asset say differently; one that is fitted may begin so."""
    said = model.actuator.values.get("spool_radius")
    if isinstance(said, float) and "spool_radius" not in model.fit:
        stated = spool_radius(mapping.bench)
        if abs(said - stated) > SAME_RADIUS * stated:
            raise InvalidMapping(
                f"spool_radius must be that of the asset {mapping.bench!r}, "
                f"{stated:g} m; [model] says {said:g} m: leave it out, mend one of the two, or "
                'list it in fit = ["spool_radius"]'
            )


def read_log(
    folder: Path, path: Path, mapping: ColumnMapping, *, mend: bool
) -> tuple[list[ImportedLog], list[Finding]]:
    """Read one log, in parts where its clock begins again, and what was found on the way."""
    stem = path.name if path.is_dir() else path.stem
    name = "_".join([*path.relative_to(folder).parent.parts, f"{stem}.csv"])
    if mapping.topics is None:
        recordings, found = rows_recordings(path, name, mapping, mend=mend)
    else:
        found = []
        recordings = [messages_recording(path, name, mapping)]
    logs = [
        ImportedLog(
            recording=recording,
            conditions={"file": stem, **{f"part{k}": p for k, p in enumerate(stem.split("_"))}},
            source=path,
            sha256=file_hash(path),
            open_start=mapping.stated_of(path.name).start is None,
        )
        for recording in recordings
    ]
    return logs, found


def messages_recording(path: Path, name: str, mapping: ColumnMapping) -> Recording:
    """Read a recording of ROS 2."""
    recording = read_recording_file(
        path, bench=mapping.bench, name=path.name, mapping=mapping.topics
    )
    try:
        return replace(recording, name=name, **mapping.stated_of(path.name).given)
    except TendonNewtonError as error:
        raise InvalidRecording(f"{path}: {error}") from error


def rows_recordings(
    path: Path, name: str, mapping: ColumnMapping, *, mend: bool
) -> tuple[list[Recording], list[Finding]]:
    """Read a file of rows, and mend its columns where that is asked for."""
    columns, found = read_mapped_columns(path, mapping, name)
    lines, parts = columns[PLACE], [columns]
    if mend:
        parts, mended = mended_columns(columns, name)
        found += [replace(one, evidence=in_lines(one.evidence, path, lines)) for one in mended]
    names = names_of_parts(name, len(parts))
    if len(parts) > 1:
        found = [replace(one, recording=own) for own in names for one in found]
    recordings: list[Recording] = []
    for own, part in zip(names, parts, strict=True):
        lines = part.pop(PLACE)
        try:
            recordings.append(make_recording(own, part, mapping, path.name))
        except TendonNewtonError as error:
            mendable = not mend and mended_columns(part, name)[1]
            told = in_lines(str(error).removeprefix(f"{own}: "), path, lines)
            raise InvalidRecording(
                f"{path}: {told}" + " (--mend does it)" * bool(mendable)
            ) from error
    return recordings, found


def in_lines(told: str, path: Path, lines: Array) -> str:
    """Return what is told of a row with its place in the file, where others may be left out."""
    return re.sub(r"\brow (\d+)", lambda row: f"{place_word(path)} {lines[int(row[1])]:.0f}", told)


def make_recording(
    name: str, columns: dict[str, Array], mapping: ColumnMapping, log: str
) -> Recording:
    """Build a recording from its columns in our units, shape (T,) each."""
    derived = not any(column.startswith("theta_dot") for column in columns)
    if derived:  # from zeros, until the times are known to increase
        angles = [column for column in columns if re.fullmatch(r"theta(_\d+)?", column)]
        columns |= {a.replace("theta", "theta_dot"): np.zeros_like(columns[a]) for a in angles}
    if "enabled" in columns:
        columns["enabled"] = np.asarray(columns["enabled"] != 0.0, dtype=np.float64)
    stated = mapping.stated_of(log).given
    recording = recording_of(dict(columns), name=name, bench=mapping.bench, **stated)
    if not derived:
        return recording
    slope = np.gradient(recording.motor_position, recording.time, axis=0)
    return replace(recording, motor_velocity=slope)


def by_joint(imported: Imported, mapping: ColumnMapping, *, mend: bool) -> Imported:
    """Return a log of each servo, which become a dataset each, in place of logs of all servos."""
    logs: list[ImportedLog] = []
    findings = [finding for finding in imported.findings if finding.recording == "all"]
    for log in imported.logs:
        whole = without_failed_reads(log.recording) if mend else log.recording
        count = whole.tendon_count
        names = mapping.joints or tuple(f"servo_{k}" for k in range(count))
        if len(names) != count or len(set(names)) < count:
            raise InvalidMapping(
                f"{mapping.path}: joints must be names that differ, one per servo: the columns of "
                f"{log.source.name} are of {count}; it is {list(names)}"
            )
        own = [finding for finding in imported.findings if finding.recording == log.recording.name]
        for k, joint in enumerate(names):
            name = f"{joint}_{log.recording.name}"
            part = replace(of_servo(whole, k), name=name)
            logs.append(replace(log, recording=part, conditions={**log.conditions, "joint": joint}))
            findings += [replace(finding, recording=name) for finding in own]
        findings += [
            replace(finding, recording=f"{names[place]}_{log.recording.name}")
            for place, finding in (*exchanges(whole, names), *neighbours_reads(whole, names))
        ]
    return replace(imported, logs=tuple(logs), findings=tuple(findings), split_by="joint")


def of_servo(recording: Recording, k: int) -> Recording:
    """Return what a recording of several servos holds of one alone, and of all of them."""
    fields = {
        name: values[:, k : k + 1]
        for name in TENDON_COLUMNS.values()
        if (values := getattr(recording, name)) is not None
    }
    fields |= {
        name: recording.extra[f"{column}_{k}"]
        for column, name in SHARED_COLUMNS.items()
        if f"{column}_{k}" in recording.extra
    }
    return replace(recording, extra={}, **fields)
