"""A mapping file: which column of somebody's logs, in which unit, is which of ours."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import pi
from pathlib import Path
from typing import Any

from tendon_newton.errors import InvalidMapping, shown, unknown_name
from tendon_newton.text_file import finite_number
from tendon_newton.toml_file import read_toml, refuse_unknown_keys

ANGLE = {"rad": 1.0, "mrad": 1.0e-3, "deg": pi / 180.0, "turn": 2.0 * pi}
SPEED = {"rad/s": 1.0, "deg/s": pi / 180.0, "rev/min": 2.0 * pi / 60.0}
FORCE = {"N": 1.0, "mN": 1.0e-3, "g": 9.80665e-3, "kg": 9.80665, "N m": 1.0, "mN m": 1.0e-3}
LENGTH = {"m": 1.0, "mm": 1.0e-3}
UNITS: dict[str, dict[str, float]] = {
    "t": {"s": 1.0, "ms": 1.0e-3, "us": 1.0e-6, "ns": 1.0e-9},
    "theta_d": ANGLE,
    "theta": ANGLE,
    "theta_dot": SPEED,
    "force": FORCE,
    "tip_x": LENGTH,
    "tip_z": LENGTH,
    "current": {"A": 1.0, "mA": 1.0e-3},
    "voltage": {"V": 1.0, "mV": 1.0e-3},
    "temperature": {"degC": 1.0},
    "enabled": {"1": 1.0},
}
"""Column of ours -> unit of theirs -> its size in ours."""
FILE_KEYS = ("bench", "files", "rows", "rate", "start", "columns", "bench_overrides",
             "actuator_overrides", "load_cell_rate", "model", "fit")  # fmt: skip
COLUMN_KEYS = ("column", "unit", "scale", "sign", "offset", "derive")
DERIVED = "theta"
"""What a speed may be derived from where none was logged."""


@dataclass(frozen=True, kw_only=True)
class MappedColumn:
    """Where one column comes from, and how it becomes ours."""

    source: str | None
    """Their column, or in JSON a path such as ``state.position[2]``; None for a derived speed."""
    scale: float = 1.0
    """Our unit per theirs, with the sign."""
    offset: float = 0.0
    """Our value where theirs is zero."""


@dataclass(frozen=True, kw_only=True)
class ColumnMapping:
    """One mapping file."""

    path: Path
    bench: str
    files: str
    """Pattern of the logs' names inside their folder."""
    rows: str | None
    """Key of the list of rows in a JSON file; None where the file is that list."""
    rate: float | None
    """Rows per second [Hz] where no column holds the time."""
    columns: Mapping[str, MappedColumn]
    entry: Mapping[str, Any]
    """What the dataset says of every recording: start, overrides, load_cell_rate."""
    model: Mapping[str, Any]
    """The model to start from, as in a model file; empty for the nominal one."""


def read_mapping(path: Path) -> ColumnMapping:
    """Read and check a mapping file."""
    table = read_toml(path, InvalidMapping, "a mapping is a TOML file")
    refuse_unknown_keys(table, FILE_KEYS, str(path), InvalidMapping)
    for key in ("bench", "columns"):
        if key not in table:
            raise InvalidMapping(f"{path}: key {key!r} is missing; see docs/recordings_mapping.md")
    columns = table["columns"]
    if not isinstance(columns, dict) or not all(isinstance(row, dict) for row in columns.values()):
        raise InvalidMapping(f"{path}: columns must hold one table per column of ours")
    mapped = {name: read_column(path, name, row) for name, row in columns.items()}
    rate = None if "rate" not in table else positive(path, "rate", table["rate"])
    for name in ("theta", "theta_dot", *(() if rate else ("t",))):
        if name not in mapped:
            raise InvalidMapping(
                f"{path}: columns must say where {name!r} comes from"
                + (" (or rate how many rows a second has)" if name == "t" else "")
                + (' (or {derive = "theta"})' if name == "theta_dot" else "")
            )
    words = {key: word(path, key, table.get(key)) for key in ("bench", "files", "rows")}
    kept = ("start", "bench_overrides", "actuator_overrides", "load_cell_rate")
    return ColumnMapping(
        path=path,
        bench=words["bench"] or "",
        files=words["files"] or "*.csv",
        rows=words["rows"],
        rate=rate,
        columns=mapped,
        entry={key: table[key] for key in kept if key in table},
        model={key: table[key] for key in ("model", "fit") if key in table},
    )


def read_column(path: Path, name: str, row: dict[str, Any]) -> MappedColumn:
    """Read the table of one column."""
    where = f"{path}: columns.{name}"
    if name not in UNITS:
        raise InvalidMapping(f"{path}: {unknown_name('column', name, UNITS)}")
    refuse_unknown_keys(row, COLUMN_KEYS, where, InvalidMapping)
    if "derive" in row:
        if (name, row["derive"]) != ("theta_dot", DERIVED) or len(row) > 1:
            raise InvalidMapping(
                f'{where}: only theta_dot = {{derive = "theta"}} can be derived; it is {shown(row)}'
            )
        return MappedColumn(source=None)
    if not isinstance(row.get("column"), str):
        raise InvalidMapping(f"{where}: column must name one of theirs; it is {shown(row)}")
    if "unit" in row and "scale" in row:
        raise InvalidMapping(f"{where}: give a unit or a scale, not both")
    unit = row.get("unit", next(iter(UNITS[name])))
    if unit not in UNITS[name]:
        raise InvalidMapping(f"{where}: {unknown_name('unit', str(unit), UNITS[name])}")
    sign = row.get("sign", 1)
    if sign not in (1, -1):
        raise InvalidMapping(f"{where}: sign must be 1 or -1; it is {shown(sign)}")
    scale, offset = (finite_number(row.get(key, default)) for key, default in
                     (("scale", UNITS[name][unit]), ("offset", 0.0)))  # fmt: skip
    if scale is None or scale == 0.0 or offset is None:
        raise InvalidMapping(f"{where}: scale must be a number that is not 0, and offset a number")
    return MappedColumn(source=row["column"], scale=sign * scale, offset=offset)


def positive(path: Path, key: str, value: Any) -> float:
    """Return a positive number."""
    number = finite_number(value)
    if number is None or number <= 0.0:
        raise InvalidMapping(f"{path}: {key} must be a positive number; it is {shown(value)}")
    return number


def word(path: Path, key: str, value: Any) -> str | None:
    """Return a word, None where it is not given."""
    if value is not None and not (isinstance(value, str) and value):
        raise InvalidMapping(f"{path}: {key} must be a word; it is {shown(value)}")
    return value
