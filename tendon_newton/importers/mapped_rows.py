"""Rows of anybody's CSV and JSON files, and numbers in them."""

import csv
import io
import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from tendon_newton.errors import InvalidRecording, listed, shown
from tendon_newton.importers.column_mapping import ColumnMapping
from tendon_newton.importers.mapped_column import MappedColumn
from tendon_newton.recording import Array
from tendon_newton.text_file import finite_number, read_text

STEP = re.compile(r"([^.\[\]]+)|\[(\d+)\]")
"""One step of a path into a row: a key, or the place in a list."""
LINES = (".jsonl", ".ndjson")
"""Suffixes of files with one JSON object per line."""
Row = Mapping[str, Any]


def read_rows(path: Path, mapping: ColumnMapping) -> list[Row]:
    """Read the rows of a file, by the suffix of its name."""
    if path.suffix in (".json", *LINES):
        rows = json_rows(path, mapping.rows)
    else:
        rows = csv_rows(path, mapping.delimiter)
    if len(rows) < 2:
        raise InvalidRecording(f"{path}: a log has two rows or more; it has {len(rows)}")
    return rows


def csv_rows(path: Path, delimiter: str) -> list[Row]:
    """Read the rows of a CSV file with a header."""
    text = read_text(path, InvalidRecording, "a log is a CSV file with a header line")
    file = io.StringIO(text, newline="")
    try:
        return list(csv.DictReader(file, skipinitialspace=True, delimiter=delimiter))
    except csv.Error as error:
        raise InvalidRecording(f"{path}: a log must be CSV: {error}") from error


def json_rows(path: Path, key: str | None) -> list[Row]:
    """Read the rows of a JSON file: a list of objects or an object of lists, maybe below a key."""
    text = read_text(path, InvalidRecording, "a log is a JSON file")
    try:
        content = (
            [json.loads(line) for line in text.splitlines() if line.strip()]
            if path.suffix in LINES
            else json.loads(text)
        )
    except (ValueError, RecursionError) as error:
        raise InvalidRecording(f"{path}: a log must be JSON: {error}") from error
    rows = content if key is None else content.get(key) if isinstance(content, dict) else None
    if isinstance(rows, dict) and (columns := lists_of(rows)):
        lengths = {name: len(values) for name, values in columns.items()}
        if len(set(lengths.values())) > 1:
            told = ", ".join(f"{name} {length}" for name, length in lengths.items())
            raise InvalidRecording(f"{path}: columns must be equally long; they have {told} rows")
        return [
            dict(zip(columns, cells, strict=True)) for cells in zip(*columns.values(), strict=True)
        ]
    if not isinstance(rows, list) or not rows or not all(isinstance(row, dict) for row in rows):
        place = "it" if key is None else f"its key {key!r}"
        raise InvalidRecording(
            f"{path}: {place} must hold a list of objects, one per row, or one list per column"
        )
    return rows


def lists_of(table: Mapping[str, Any]) -> dict[str, list[Any]]:
    """Return the columns of an object of lists; none where a list holds objects."""
    columns = {name: values for name, values in table.items() if isinstance(values, list)}
    holds_rows = any(isinstance(item, dict) for values in columns.values() for item in values)
    return {} if holds_rows else columns


def mapped_column(path: Path, rows: list[Row], column: MappedColumn) -> Array:
    """Return one column in our unit, shape (T,)."""
    assert column.source is not None
    values = np.empty(len(rows))
    for place, row in enumerate(rows):
        found = cell(row, column.source)
        number = number_in(found)
        if number is None:
            known = "" if column.source in row else f"; there are {listed(map(str, row))}"
            raise InvalidRecording(
                f"{path}: {column.source} must be a number; row {place} has {shown(found)}{known}"
            )
        values[place] = number
    return column.scale * values + column.offset


def cell(row: Row, source: str) -> Any:
    """Return what a row holds: a column of that very name, or what a path leads to."""
    if source in row:
        return row[source]
    value: Any = row
    for key, index in STEP.findall(source):
        if isinstance(value, str):
            value = list_in(value)
        if key and isinstance(value, dict):
            value = value.get(key)
        elif index and isinstance(value, list) and int(index) < len(value):
            value = value[int(index)]
        else:
            return None
    return value


def list_in(text: str) -> Any:
    """Return the list that stands in a cell of text, as in ``"[0.1, 0.2]"``; None where none."""
    try:
        return json.loads(text)
    except (ValueError, RecursionError):
        return None


def number_in(value: Any) -> float | None:
    """Return a number, also one that stands in a text; None where it is none."""
    if isinstance(value, bool):
        return float(value)
    if isinstance(value, str):
        try:
            value = float(value)
        except ValueError:
            return None
    return finite_number(value)
