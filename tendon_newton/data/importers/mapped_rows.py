"""Rows of anybody's CSV and JSON files, and numbers in them."""

import csv
import json
import re
from array import array
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from tendon_newton.data.files.text_file import LOG_SIZE_LIMIT, finite_number, open_text, read_text
from tendon_newton.data.importers.column_mapping import ColumnMapping
from tendon_newton.data.importers.mapped_column import MappedColumn
from tendon_newton.data.recording import Array
from tendon_newton.errors import InvalidRecording, listed, shown

STEP = re.compile(r"([^.\[\]]+)|\[(\d+)\]")
"""One step of a path into a row: a key, or the place in a list."""
LINES = (".jsonl", ".ndjson")
"""Suffixes of files with one JSON object per line."""
JSON_SIZE_LIMIT = 1 << 25
"""Bytes of a JSON log, whose rows take twenty times as much in memory."""
Row = Mapping[str, Any]


def read_mapped_columns(path: Path, mapping: ColumnMapping) -> dict[str, Array]:
    """Read the columns that a mapping names, in our units, shape (T,) each."""
    wanted = {name: column for name, column in mapping.columns.items() if column.source is not None}
    numbers = {name: array("d") for name in wanted}
    count = 0
    for count, row in enumerate(read_rows(path, mapping), start=1):
        for name, column in wanted.items():
            numbers[name].append(number_of(path, count - 1, row, column))
    if count < 2:
        raise InvalidRecording(f"{path}: a log has two rows or more; it has {count}")
    columns = {
        name: column.scale * np.frombuffer(numbers[name]) + column.offset
        for name, column in wanted.items()
    }
    if "t" not in columns:
        assert mapping.rate is not None
        columns["t"] = np.arange(count) / mapping.rate
    return columns


def read_rows(path: Path, mapping: ColumnMapping) -> Iterator[Row]:
    """Read the rows of a file one by one, by the suffix of its name."""
    if path.suffix in (".json", *LINES):
        yield from json_rows(path, mapping.rows)
    else:
        yield from csv_rows(path, mapping.delimiter)


def csv_rows(path: Path, delimiter: str) -> Iterator[Row]:
    """Read the rows of a CSV file with a header."""
    promise = "a log is a CSV file with a header line"
    with open_text(path, InvalidRecording, promise, size_limit=LOG_SIZE_LIMIT) as file:
        try:
            yield from csv.DictReader(file, skipinitialspace=True, delimiter=delimiter)
        except csv.Error as error:
            raise InvalidRecording(f"{path}: a log must be CSV: {error}") from error


def json_rows(path: Path, key: str | None) -> list[Row]:
    """Read the rows of a JSON file: a list of objects or an object of lists, maybe below a key."""
    text = read_text(path, InvalidRecording, "a log is a JSON file", size_limit=JSON_SIZE_LIMIT)
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


def number_of(path: Path, place: int, row: Row, column: MappedColumn) -> float:
    """Return one number of a row, as it stands there."""
    assert column.source is not None
    found = cell(row, column.source)
    number = number_in(found)
    if number is None:
        known = "" if column.source in row else f"; there are {listed(map(str, row))}"
        raise InvalidRecording(
            f"{path}: {column.source} must be a number; row {place} has {shown(found)}{known}"
        )
    return number


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
