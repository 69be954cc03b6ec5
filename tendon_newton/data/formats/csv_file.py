"""Recordings as CSV files: a header line of column names, then one row per sample."""

import csv
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tendon_newton.data.files.text_file import drafted
from tendon_newton.data.formats.csv_columns import INDEX, Columns, require
from tendon_newton.data.recording import Array, Mask, Recording
from tendon_newton.errors import InvalidRecording, listed

# column -> field, for columns of which there is one per tendon (theta_0, theta_1, ...)
TENDON_COLUMNS = {
    "theta_d": "command",
    "theta": "motor_position",
    "theta_dot": "motor_velocity",
    "force": "force",
}
JOINT_COLUMN, JOINT_FIELD = "joint_angle", "joint_position"  # One per joint, as of tendons
SHARED_COLUMNS = {
    "joint_load": "joint_load",
    "current": "current",
    "voltage": "voltage",
    "temperature": "temperature",
}


def recording_of(there: Columns, *, name: str, **entry: Any) -> Recording:
    """Make a recording of columns in our units, (T,) each by name; those it takes are gone then."""
    header = tuple(there)
    known: dict[str, NDArray[Any]] = {
        field: tendon_columns(there, column, name)
        for column, field in TENDON_COLUMNS.items()
        if cells_named(there, column)
    }
    check_servos(known, name)
    if cells_named(there, JOINT_COLUMN):
        known[JOINT_FIELD] = tendon_columns(there, JOINT_COLUMN, name)
    for column, field in SHARED_COLUMNS.items():
        if (values := shared_column(there, column, name)) is not None:
            known[field] = values
    if (enabled := shared_column(there, "enabled", name)) is not None:
        known["enabled"] = switch(enabled, name)
    if "tip_x" in there or "tip_z" in there:
        require(header, ("tip_x", "tip_z"), name)
        known["tip"] = np.column_stack([there.pop(column) for column in ("tip_x", "tip_z")])
    time = there.pop("t")
    return Recording(name=name, time=time, extra=there, **known, **entry)


def write_csv(path: Path, recording: Recording) -> None:
    """Write one recording so that reading it gives the same numbers, bit for bit."""
    columns: dict[str, NDArray[Any]] = {"t": recording.time}
    for column, field in {**TENDON_COLUMNS, JOINT_COLUMN: JOINT_FIELD}.items():
        values = getattr(recording, field)
        if values is not None:
            columns |= named_by_tendon(column, values)
    if recording.tip is not None:
        columns |= {"tip_x": recording.tip[:, 0], "tip_z": recording.tip[:, 1]}
    for column, field in SHARED_COLUMNS.items():
        if (values := getattr(recording, field)) is not None:
            columns[column] = values
    if not recording.enabled.all():
        columns["enabled"] = recording.enabled.astype(np.int64)
    write_columns(path, columns | dict(recording.extra))


def write_columns(path: Path, columns: Mapping[str, NDArray[Any]]) -> None:
    """Write named columns of equal length; floats in their shortest exact form."""
    rows = zip(*(values.tolist() for values in columns.values()), strict=True)
    with drafted(path) as draft, draft.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows(rows)


def named_by_tendon(column: str, values: Array) -> dict[str, Array]:
    """Name the columns of a channel: plain for one tendon or joint, indexed for several."""
    count = values.shape[1]
    names = [column] if count == 1 else [f"{column}_{place}" for place in range(count)]
    return {name: values[:, place] for place, name in enumerate(names)}


def tendon_columns(there: Columns, column: str, name: str) -> Array:
    """Take a channel's columns out of the table, one per tendon or joint, shape (T, D)."""
    indices = sorted(
        int(match[1]) for cell in there if (match := re.fullmatch(rf"{column}_({INDEX})", cell))
    )
    if column in there and indices:
        part = "joint" if column == JOINT_COLUMN else "tendon"
        raise InvalidRecording(
            f"{name}: {column!r} must be one column, or one per {part} with an index; both came"
        )
    if indices != list(range(len(indices))):
        raise InvalidRecording(
            f"{name}: {column!r} must be indexed from 0 without gaps; came "
            + listed(f"{column}_{place}" for place in indices)
        )
    names = [f"{column}_{place}" for place in indices] or [column]
    return np.column_stack([there.pop(cell) for cell in names])


def check_servos(known: Mapping[str, NDArray[Any]], name: str) -> None:
    """Refuse channels of which some servos have a column and others have none."""
    counts = {column: known[field].shape[1] for column, field in TENDON_COLUMNS.items()
              if field in known}  # fmt: skip
    most = max(counts.values(), default=0)
    for column, count in counts.items():
        if count < most:
            full = next(other for other in counts if counts[other] == most)
            raise InvalidRecording(
                f"{name}: column '{column}_{count}' is missing; {full} is there for {most} servos"
            )


def shared_column(there: Columns, column: str, name: str) -> Array | None:
    """Take a column that serves all tendons out of the table, shape (T,).

    One column per tendon is taken as one where all are equal, else kept as unknown columns; but
    what is switched off must not be ignored.
    """
    names = cells_named(there, column)
    series = [there[cell] for cell in names]
    if not names:
        return None
    if all(np.array_equal(series[0], values) for values in series):
        for cell in names:
            del there[cell]
        return series[0]
    if column == "enabled":
        raise InvalidRecording(
            f"{name}: enabled must be the same for all tendons; {', '.join(names)} differ"
        )
    return None


def cells_named(there: Columns, column: str) -> list[str]:
    """Header cells of a channel: plain or with the index of a tendon."""
    return [cell for cell in there if re.fullmatch(rf"{column}(_({INDEX}))?", cell)]


def switch(values: Array, name: str) -> Mask:
    """Read a column that may only hold 0 and 1."""
    (bad,) = np.nonzero((values != 0.0) & (values != 1.0))
    if bad.size:
        raise InvalidRecording(
            f"{name}: enabled must be 0 or 1; row {bad[0]} is {values[bad[0]]:g}"
        )
    return values == 1.0
