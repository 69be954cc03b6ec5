"""A mapping file: which column or topic of somebody's logs, in which unit, is which of ours."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any, Literal

from tendon_newton.data.bench_overrides import BenchOverrides, read_bench_overrides
from tendon_newton.data.files.checked_table import CheckedTable
from tendon_newton.data.files.toml_file import read_toml, refuse_unknown_keys
from tendon_newton.data.formats.mapped_column import (
    TOPIC_FILE_KEYS,
    Columns,
    MappedColumn,
    read_columns,
    read_topics,
    word,
)
from tendon_newton.data.formats.topic_mapping import TopicMapping
from tendon_newton.data.importers.csv_dialect import CsvDialect
from tendon_newton.errors import InvalidMapping, TendonNewtonError

ROW_KEYS = ("rows", "rate", "resample", "delimiter", "decimal", "comment", "header")
"""Keys for files of rows: CSV and JSON."""
MODEL_KEYS = ("model", "fit", "tolerances")
"""Keys of the model to start from, as in a model file."""
STATED_KEYS = ("start", "bench_overrides", "actuator_overrides", "load_cell_rate", "current_in")
"""Keys of what is stated of logs that no column holds."""
OTHER_KEYS = ("bench", "files", "joints", "logs", *MODEL_KEYS)
FILE_KEYS = (*OTHER_KEYS, *ROW_KEYS, *TOPIC_FILE_KEYS, *STATED_KEYS)


@dataclass(frozen=True, kw_only=True)
class StatedNumbers:
    """Numbers of the logs whose names match a pattern."""

    pattern: str  # Pattern of the logs' names, as in a shell: ``kp100_*``
    # State from which a simulation starts; None leaves it
    start: Literal["equilibrium", "first_row"] | None = None
    bench_overrides: BenchOverrides = field(default_factory=BenchOverrides)  # Numbers of the bench
    # Numbers of the actuator, in its own units
    actuator_overrides: Mapping[str, float] = field(default_factory=dict[str, float])
    # Rate of the load cell [Hz], where it is slower than the rows
    load_cell_rate: float | None = None
    current_in: Literal["winding"] | None = None  # Where the current flows, if not in the supply

    @property
    def given(self) -> dict[str, Any]:
        """What is stated, as the fields of a recording."""
        return {key: value for key in STATED_KEYS if (value := getattr(self, key)) is not None}

    def with_(self, other: "StatedNumbers") -> "StatedNumbers":
        """Return these numbers where the other has none of its own."""
        return replace(
            self,
            start=other.start or self.start,
            bench_overrides=BenchOverrides(
                **{**self.bench_overrides.given, **other.bench_overrides.given}
            ),
            actuator_overrides={**self.actuator_overrides, **other.actuator_overrides},
            load_cell_rate=other.load_cell_rate or self.load_cell_rate,
            current_in=other.current_in or self.current_in,
        )


@dataclass(frozen=True, kw_only=True)
class ColumnMapping:
    """Content of one mapping file."""

    path: Path
    bench: str
    files: str  # Pattern of the logs' names inside their folder
    # Names of the servos, each of which becomes a dataset; empty where all are of one bench
    joints: tuple[str, ...]
    rows: str | None  # Key of the rows in a JSON file; None where the file is the rows
    rate: float | None  # Rows per second [Hz] where no column holds the time
    # Rows per second [Hz] that are made of more; None where the rows are taken as they are
    resample: float | None
    dialect: CsvDialect  # Form of a CSV file, as far as stated
    columns: Mapping[str, MappedColumn]  # Column of ours -> theirs; empty where topics are mapped
    # Column of ours -> topic and field of a ROS 2 recording; None where columns are mapped
    topics: TopicMapping | None
    # Numbers stated of all logs, then of those that a pattern names; later ones win
    stated: tuple[StatedNumbers, ...]
    # The model to start from, as in a model file; empty for the nominal one
    model: Mapping[str, Any]

    def stated_of(self, name: str) -> StatedNumbers:
        """Return all that is stated of a log of some name."""
        found, *more = (part for part in self.stated if fnmatchcase(name, part.pattern))
        for part in more:
            found = found.with_(part)
        return found


def read_mapping(path: Path, only: Sequence[str] = ()) -> ColumnMapping:
    """Read and check a mapping file.

    Args:
        only: Columns that are read, with a speed that is derived; all that are mapped, and the
            speed as the mapping says, by default.
    """
    read = read_toml(path, InvalidMapping, "a mapping is a TOML file")
    if "recordings" in read:
        raise InvalidMapping(
            f"{path}: is the list of a dataset; a mapping.toml says which column is which "
            "(docs/recordings_mapping.md)"
        )
    refuse_unknown_keys(read, FILE_KEYS, str(path), InvalidMapping)
    table = CheckedTable(read, str(path), InvalidMapping)
    for key in ("bench", "columns"):
        if key not in table:
            raise InvalidMapping(f"{path}: key {key!r} is missing; see docs/recordings_mapping.md")
    mapped = read_columns(table)
    if only:
        kept = {n: c for n, c in mapped.items() if n.rstrip("_0123456789") in only}
        mapped = {**kept, "theta_dot": MappedColumn(source=None)}
    topics = read_topics(path, mapped, word(table, "clock"))
    for key in ROW_KEYS if topics else ("clock",):
        if key in table:
            kind = "CSV and JSON files" if topics else "ROS 2 recordings"
            raise InvalidMapping(
                f"{path}: {key} belongs to a mapping of {kind}; this mapping has none"
            )
    rates = {key: positive(table, key) for key in ("rate", "resample") if key in table}
    if topics is None:
        require_columns(path, mapped, timed="rate" in rates)
    return ColumnMapping(
        path=path,
        bench=word(table, "bench") or "",
        files=word(table, "files") or ("*" if topics else "*.csv"),
        joints=table.words("joints") if "joints" in table else (),
        rows=word(table, "rows"),
        rate=rates.get("rate"),
        resample=rates.get("resample"),
        dialect=read_dialect(table),
        columns={n: c for n, c in mapped.items() if isinstance(c, MappedColumn) and not topics},
        topics=topics,
        stated=read_patterns(table),
        model={key: read[key] for key in MODEL_KEYS if key in read},
    )


def require_columns(path: Path, mapped: Columns, *, timed: bool) -> None:
    """Refuse a mapping without what every recording has."""
    for name in ("theta", "theta_dot", *(() if timed else ("t",))):
        if name not in mapped and f"{name}_0" not in mapped:
            raise InvalidMapping(
                f"{path}: columns must say where {name!r} comes from"
                + (" (or rate how many rows a second has)" if name == "t" else "")
                + (' (or {derive = "theta"})' if name == "theta_dot" else "")
            )
    speeds = [column for name, column in mapped.items() if name.startswith("theta_dot")]
    if len({getattr(column, "source", None) is None for column in speeds}) > 1:
        raise InvalidMapping(
            f"{path}: theta_dot must be in a column for every servo, or derived for all of them: "
            'theta_dot = {derive = "theta"}'
        )


def read_patterns(table: CheckedTable) -> tuple[StatedNumbers, ...]:
    """Read what is stated of all logs and of those that patterns name."""
    every = {key: table.values[key] for key in STATED_KEYS if key in table}
    first = read_stated("*", CheckedTable(every, table.where, InvalidMapping))
    if "logs" not in table:
        return (first,)
    logs = table.table("logs")
    return (first, *(read_stated(pattern, logs.table(pattern)) for pattern in logs.values))


def read_dialect(table: CheckedTable) -> CsvDialect:
    """Return what is said of the form of CSV files."""
    delimiter, decimal = table.value("delimiter", str | None), table.values.get("decimal")
    if delimiter is not None and (len(delimiter) != 1 or delimiter in '"\n\r'):
        table.refuse("delimiter", "one character, such as ';'")
    if decimal not in (None, ".", ","):
        table.refuse("decimal", "'.' or ','")
    header = table.words("header") if "header" in table else ()
    return CsvDialect(
        delimiter=delimiter, decimal=decimal, comment=word(table, "comment"), header=header
    )


def positive(table: CheckedTable, key: str) -> float:
    """Return a positive number."""
    number = table.number(key)
    return number if number > 0.0 else table.refuse(key, "a positive number")


def read_stated(pattern: str, table: CheckedTable) -> StatedNumbers:
    """Read what is stated of the logs whose names match a pattern."""
    refuse_unknown_keys(table.values, STATED_KEYS, table.where, InvalidMapping)
    try:
        overrides = read_bench_overrides(table.values.get("bench_overrides", {}))
    except TendonNewtonError as error:
        raise InvalidMapping(f"{table.where}: {error}") from error
    if "load_cell_rate" in table:
        positive(table, "load_cell_rate")
    return table.record(StatedNumbers, pattern=pattern, bench_overrides=overrides)
