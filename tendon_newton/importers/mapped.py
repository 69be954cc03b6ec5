"""Anybody's CSV or JSON logs, by a mapping file (see ``docs/recordings_mapping.md``)."""

import csv
import hashlib
import io
import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from tendon_newton.bench_overrides import read_bench_overrides
from tendon_newton.errors import InvalidMapping, InvalidRecording, TendonNewtonError, listed, shown
from tendon_newton.importers.column_mapping import ColumnMapping, MappedColumn, read_mapping
from tendon_newton.importers.imported import Imported, ImportedLog
from tendon_newton.model_file import Model, NamedValues, read_actuator, read_fit
from tendon_newton.recording import Array, Recording
from tendon_newton.text_file import finite_number, read_text

STEP = re.compile(r"([^.\[\]]+)|\[(\d+)\]")
"""One step of a path into a row of JSON: a key, or the place in a list."""
NOMINAL = {"gain": 4.2, "spool_radius": 0.0125}
"""The force source of the paper, where a mapping states no model."""
Row = Mapping[str, Any]


def read_mapped(folder: Path, mapping_file: Path) -> Imported:
    """Read every log of a folder that a mapping file's pattern matches."""
    mapping = read_mapping(mapping_file)
    if not folder.is_dir():
        came = "it is a file" if folder.exists() else "no such folder"
        raise InvalidRecording(f"{folder}: logs come as a folder; {came}")
    paths = sorted(path for path in folder.glob(mapping.files) if path.is_file())
    if not paths:
        raise InvalidRecording(f"{folder}: no log matches files = {mapping.files!r}")
    logs = tuple(read_log(folder, path, mapping) for path in paths)
    return Imported(logs=logs, model=start_model(mapping), limits={}, findings=())


def start_model(mapping: ColumnMapping) -> Model:
    """Return the model that a mapping states, or the nominal one of its bench."""
    try:
        if "model" in mapping.model:
            return Model(
                actuator=read_actuator(mapping.model["model"]),
                fit=read_fit(mapping.model.get("fit", [])),
            )
        nominal = (
            NamedValues(name="ideal_position", values={})
            if mapping.bench == "servo"
            else NamedValues(name="ideal", values=NOMINAL)
        )
        return Model(actuator=nominal, fit=read_fit(mapping.model.get("fit", [])))
    except TendonNewtonError as error:
        raise InvalidMapping(f"{mapping.path}: {error}") from error


def read_log(folder: Path, path: Path, mapping: ColumnMapping) -> ImportedLog:
    """Read one log."""
    rows = json_rows(path, mapping.rows) if path.suffix == ".json" else csv_rows(path)
    columns = {
        name: mapped_column(path, rows, column)
        for name, column in mapping.columns.items()
        if column.source is not None
    }
    if "t" not in columns:
        assert mapping.rate is not None
        columns["t"] = np.arange(len(rows)) / mapping.rate
    name = path.relative_to(folder).with_suffix(".csv")
    recording = make_recording(path, "_".join(name.parts), columns, mapping)
    return ImportedLog(
        recording=recording,
        conditions={
            "file": path.stem,
            **{f"part{k}": p for k, p in enumerate(path.stem.split("_"))},
        },
        source=path,
        sha256=hashlib.sha256(path.read_bytes()).hexdigest(),
    )


def make_recording(
    path: Path, name: str, columns: dict[str, Array], mapping: ColumnMapping
) -> Recording:
    """Build a recording from its columns in our units, shape (T,) each."""
    speed = columns.get("theta_dot")
    tips = [columns[key] for key in ("tip_x", "tip_z") if key in columns]
    entry = dict(mapping.entry)
    enabled = columns.get("enabled")
    try:
        if speed is None:
            speed = np.gradient(columns["theta"], columns["t"])
        entry["bench_overrides"] = read_bench_overrides(entry.get("bench_overrides", {}))
        return Recording(
            name=name,
            bench=mapping.bench,
            time=columns["t"],
            motor_position=columns["theta"][:, None],
            motor_velocity=speed[:, None],
            command=columns["theta_d"][:, None] if "theta_d" in columns else None,
            force=columns["force"][:, None] if "force" in columns else None,
            tip=np.stack(tips, axis=1) if len(tips) == 2 else None,
            current=columns.get("current"),
            voltage=columns.get("voltage"),
            temperature=columns.get("temperature"),
            **({} if enabled is None else {"enabled": enabled != 0.0}),
            **entry,
        )
    except TendonNewtonError as error:
        raise InvalidRecording(f"{path}: {error}") from error


def csv_rows(path: Path) -> list[Row]:
    """Read the rows of a CSV file with a header."""
    text = read_text(path, InvalidRecording, "a log is a CSV file with a header line")
    rows: list[Row] = list(csv.DictReader(io.StringIO(text, newline=""), skipinitialspace=True))
    if len(rows) < 2:
        raise InvalidRecording(
            f"{path}: a log has a header and two rows or more; it has {len(rows)}"
        )
    return rows


def json_rows(path: Path, key: str | None) -> list[Row]:
    """Read the rows of a JSON file: a list of objects, or one below a key."""
    text = read_text(path, InvalidRecording, "a log is a JSON file")
    try:
        content = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise InvalidRecording(f"{path}: a log must be JSON: {error}") from error
    rows = content if key is None else content.get(key) if isinstance(content, dict) else None
    if not isinstance(rows, list) or not rows or not all(isinstance(row, dict) for row in rows):
        place = "it" if key is None else f"its key {key!r}"
        raise InvalidRecording(f"{path}: {place} must hold a list of objects, one per row")
    return rows


def mapped_column(path: Path, rows: list[Row], column: MappedColumn) -> Array:
    """Return one column in our unit, shape (T,)."""
    assert column.source is not None
    values = np.empty(len(rows))
    for place, row in enumerate(rows):
        number = number_in(cell(row, column.source))
        if number is None:
            known = "" if column.source in row else f"; there are {listed(map(str, row))}"
            raise InvalidRecording(
                f"{path}: {column.source} must be a number; row {place} has "
                f"{shown(cell(row, column.source))}{known}"
            )
        values[place] = number
    return column.scale * values + column.offset


def cell(row: Row, source: str) -> Any:
    """Return what a row holds: a column of that very name, or what a path leads to."""
    if source in row:
        return row[source]
    value: Any = row
    for key, index in STEP.findall(source):
        if key and isinstance(value, dict):
            value = value.get(key)
        elif index and isinstance(value, list) and int(index) < len(value):
            value = value[int(index)]
        else:
            return None
    return value


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
