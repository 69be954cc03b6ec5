"""Recordings as CSV files: a header line of column names, then one row per sample."""

import csv
import io
import re
from collections import Counter
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tendon_newton.errors import InvalidRecording, listed, shown
from tendon_newton.recording import Array, Mask, Recording
from tendon_newton.text_file import read_text

# column -> field, for columns of which there is one per tendon (theta_0, theta_1, ...)
TENDON_COLUMNS = {
    "theta_d": "command",
    "theta": "motor_position",
    "theta_dot": "motor_velocity",
    "force": "force",
}
SHARED_COLUMNS = ("current", "voltage", "temperature", "enabled")
REQUIRED_COLUMNS = ("t", "theta", "theta_dot")
KNOWN_COLUMNS = ("t", *TENDON_COLUMNS, "tip_x", "tip_z", *SHARED_COLUMNS)

INDEX = "0|[1-9][0-9]{0,2}"
"""How the number of a tendon is written; no servo bus carries a thousand."""

WORD_LIMIT = 1000
"""Longest cell of an unknown column [characters]: all rows are padded to the longest."""

TextColumns = dict[str, list[str]]


def read_csv(path: Path, *, bench: str, name: str | None = None, **entry: Any) -> Recording:
    """Read one recording.

    Args:
        path: The file.
        bench: Name under ``assets/`` of the bench that was measured.
        name: Name for messages and outputs; the file's own name unless given.
        entry: What else the dataset says of it (``start``, ``bench_overrides``,
            ``actuator_overrides``, ``load_cell_rate``).
    """
    name = name or path.name
    text = read_columns(path, name)
    header = tuple(text)
    known: dict[str, NDArray[Any]] = {
        field: tendon_columns(text, column, name)
        for column, field in TENDON_COLUMNS.items()
        if cells_named(text, column)
    }
    for column in SHARED_COLUMNS:
        if (values := shared_column(text, column, name)) is not None:
            known[column] = values if column != "enabled" else switch(values, name)
    if "tip_x" in text or "tip_z" in text:
        require(header, ("tip_x", "tip_z"), name)
        tip = [numbers(text.pop(column), column, name) for column in ("tip_x", "tip_z")]
        known["tip"] = np.column_stack(tip)
    time = numbers(text.pop("t"), "t", name)
    extra = {column: numbers_or_words(cells, column, name) for column, cells in text.items()}
    return Recording(name=name, bench=bench, time=time, extra=extra, **known, **entry)


def write_csv(path: Path, recording: Recording) -> None:
    """Write one recording so that reading it gives the same numbers, bit for bit."""
    columns: dict[str, NDArray[Any]] = {"t": recording.time}
    for column, field in TENDON_COLUMNS.items():
        values = getattr(recording, field)
        if values is not None:
            columns |= named_by_tendon(column, values)
    if recording.tip is not None:
        columns |= {"tip_x": recording.tip[:, 0], "tip_z": recording.tip[:, 1]}
    for column in ("current", "voltage", "temperature"):
        if (values := getattr(recording, column)) is not None:
            columns[column] = values
    if not recording.enabled.all():
        columns["enabled"] = recording.enabled.astype(np.int64)
    write_columns(path, columns | dict(recording.extra))


def write_columns(path: Path, columns: Mapping[str, NDArray[Any]]) -> None:
    """Write named columns of equal length; floats in their shortest exact form."""
    rows = zip(*(values.tolist() for values in columns.values()), strict=True)
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows(rows)


def named_by_tendon(column: str, values: Array) -> dict[str, Array]:
    """Name the columns of a channel: plain for one tendon, indexed for several."""
    count = values.shape[1]
    names = [column] if count == 1 else [f"{column}_{place}" for place in range(count)]
    return {name: values[:, place] for place, name in enumerate(names)}


def read_columns(path: Path, name: str) -> TextColumns:
    """Read the cells of every column as text."""
    text = read_text(path, InvalidRecording, "a recording is a CSV file")
    try:
        lines = list(csv.reader(io.StringIO(text, newline=""), skipinitialspace=True))
    except csv.Error as error:
        raise InvalidRecording(f"{name}: not a CSV file: {error} ({path})") from error
    return columns_of(lines, name)


def columns_of(lines: list[list[str]], name: str) -> TextColumns:
    """Turn the lines of a file into columns, checking header and widths."""
    if not any(lines):
        raise InvalidRecording(f"{name}: a recording needs a header line and rows; it is empty")
    header = [cell.strip() for cell in lines[0]]
    check_header(header, name)
    rows = []
    for number, row in enumerate(lines[1:], start=2):
        if len(row) == len(header):
            rows.append(row)
        elif row:
            raise InvalidRecording(
                f"{name}: every line must have {len(header)} cells as the header has; "
                f"line {number} has {len(row)}"
            )
    if not rows:
        raise InvalidRecording(f"{name}: a recording needs rows below its header; it has none")
    cells = zip(*rows, strict=True)
    return dict(zip(header, ([cell.strip() for cell in column] for column in cells), strict=True))


def check_header(header: list[str], name: str) -> None:
    """Refuse a header with doubled, empty or missing columns."""
    for cell, count in Counter(header).items():
        if count > 1 or not cell:
            fault = f"{shown(cell)} stands {count} times" if cell else "one is empty"
            raise InvalidRecording(f"{name}: column names must differ and not be empty; {fault}")
    if len(header) == 1 and re.search(r"[;\t ]", header[0]):
        raise InvalidRecording(f"{name}: cells must be separated by commas; line 1 has none")
    indexed = {cell.removesuffix("_0") for cell in header if cell.removesuffix("_0") != "t"}
    require([*indexed, *header], REQUIRED_COLUMNS, name)


def require(present: Iterable[str], columns: tuple[str, ...], name: str) -> None:
    """Refuse a file that lacks one of some columns."""
    present = sorted(set(present))
    missing = [column for column in columns if column not in present]
    if missing:
        raise InvalidRecording(
            f"{name}: column {missing[0]!r} is missing; there are {listed(present)} "
            f"(known columns: {', '.join(KNOWN_COLUMNS)})"
        )


def tendon_columns(text: TextColumns, column: str, name: str) -> Array:
    """Take a channel's columns out of the text, one per tendon, shape (T, D)."""
    indices = sorted(
        int(match[1]) for cell in text if (match := re.fullmatch(rf"{column}_({INDEX})", cell))
    )
    if column in text and indices:
        raise InvalidRecording(
            f"{name}: {column!r} must be one column, or one per tendon with an index; both came"
        )
    if indices != list(range(len(indices))):
        raise InvalidRecording(
            f"{name}: {column!r} must be indexed from 0 without gaps; came "
            + listed(f"{column}_{place}" for place in indices)
        )
    names = [f"{column}_{place}" for place in indices] or [column]
    return np.column_stack([numbers(text.pop(cell), cell, name) for cell in names])


def shared_column(text: TextColumns, column: str, name: str) -> Array | None:
    """Take a column that serves all tendons out of the text, shape (T,).

    One column per tendon is taken as one where all are equal, else kept as unknown columns; but
    what is switched off must not be ignored.
    """
    names = cells_named(text, column)
    series = [numbers(text[cell], cell, name) for cell in names]
    if not names:
        return None
    if all(np.array_equal(series[0], values) for values in series):
        for cell in names:
            del text[cell]
        return series[0]
    if column == "enabled":
        raise InvalidRecording(
            f"{name}: enabled must be the same for all tendons; {', '.join(names)} differ"
        )
    return None


def cells_named(text: TextColumns, column: str) -> list[str]:
    """Header cells of a channel: plain or with the index of a tendon."""
    return [cell for cell in text if re.fullmatch(rf"{column}(_({INDEX}))?", cell)]


def numbers(cells: list[str], column: str, name: str) -> Array:
    """Read one column of numbers, naming the line of a cell that is none."""
    try:
        return np.array(cells, dtype=np.float64)
    except ValueError as error:
        for row, cell in enumerate(cells):
            if not is_number(cell):
                came = f"is {shown(cell)}" if cell else "is empty"
                raise InvalidRecording(
                    f"{name}: {column} must be a number; row {row} {came}"
                ) from error
        raise


def numbers_or_words(cells: list[str], column: str, name: str) -> NDArray[Any]:
    """Read an unknown column: numbers if all of its cells are, else words."""
    try:
        return np.array(cells, dtype=np.float64)
    except ValueError:
        if max(map(len, cells)) > WORD_LIMIT:
            raise InvalidRecording(
                f"{name}: a cell holds a number or at most {WORD_LIMIT} characters; one of "
                f"{shown(column)} has {max(map(len, cells))}"
            ) from None
        return np.array(cells, dtype=np.str_)


def is_number(cell: str) -> bool:
    """Tell whether a cell reads as a number."""
    try:
        float(cell)
    except ValueError:
        return False
    return True


def switch(values: Array, name: str) -> Mask:
    """Read a column that may only hold 0 and 1."""
    (bad,) = np.nonzero((values != 0.0) & (values != 1.0))
    if bad.size:
        raise InvalidRecording(
            f"{name}: enabled must be 0 or 1; row {bad[0]} is {values[bad[0]]:g}"
        )
    return values == 1.0
