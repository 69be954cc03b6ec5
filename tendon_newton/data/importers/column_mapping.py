"""A mapping file: which column or topic of somebody's logs, in which unit, is which of ours."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any, Literal

from tendon_newton.data.bench_overrides import BenchOverrides, read_bench_overrides
from tendon_newton.data.files.checked_table import CheckedTable
from tendon_newton.data.files.text_file import finite_number
from tendon_newton.data.files.toml_file import read_toml, refuse_unknown_keys
from tendon_newton.data.files.values import are_tables, are_words, is_table
from tendon_newton.data.formats.mapped_column import (
    DERIVED,
    TOPIC_FILE_KEYS,
    Columns,
    MappedColumn,
    read_columns,
    read_topics,
    word,
)
from tendon_newton.data.formats.topic_mapping import TopicMapping
from tendon_newton.data.importers.csv_dialect import CsvDialect
from tendon_newton.errors import InvalidMapping, TendonNewtonError, shown

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
    table = read_toml(path, InvalidMapping, "a mapping is a TOML file")
    if "recordings" in table:
        raise InvalidMapping(
            f"{path}: is the list of a dataset; a mapping.toml says which column is which "
            "(docs/recordings_mapping.md)"
        )
    refuse_unknown_keys(table, FILE_KEYS, str(path), InvalidMapping)
    for key in ("bench", "columns"):
        if key not in table:
            raise InvalidMapping(f"{path}: key {key!r} is missing; see docs/recordings_mapping.md")
    mapped = read_columns(path, table["columns"])
    if only:
        speed = read_columns(path, {"theta_dot": {"derive": DERIVED}})
        kept = {n: c for n, c in mapped.items() if n.rstrip("_0123456789") in only}
        mapped = {**kept, **speed}
    topics = read_topics(path, mapped, table.get("clock"))
    for key in ROW_KEYS if topics else ("clock",):
        if key in table:
            kind = "CSV and JSON files" if topics else "ROS 2 recordings"
            raise InvalidMapping(
                f"{path}: {key} belongs to a mapping of {kind}; this mapping has none"
            )
    rates = {key: positive(path, key, table[key]) for key in ("rate", "resample") if key in table}
    if topics is None:
        require_columns(path, mapped, timed="rate" in rates)
    words = {key: word(path, key, table.get(key)) for key in ("bench", "files", "rows")}
    return ColumnMapping(
        path=path,
        bench=words["bench"] or "",
        files=words["files"] or ("*" if topics else "*.csv"),
        joints=read_names(path, "joints", table),
        rows=words["rows"],
        rate=rates.get("rate"),
        resample=rates.get("resample"),
        dialect=read_dialect(path, table),
        columns={n: c for n, c in mapped.items() if isinstance(c, MappedColumn) and not topics},
        topics=topics,
        stated=read_patterns(path, table),
        model={key: table[key] for key in MODEL_KEYS if key in table},
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


def read_patterns(path: Path, table: Mapping[str, Any]) -> tuple[StatedNumbers, ...]:
    """Read what is stated of all logs and of those that patterns name."""
    logs = table.get("logs", {})
    if not is_table(logs) or not are_tables([*logs.values()]):
        raise InvalidMapping(f"{path}: logs must hold one table per pattern of names")
    parts = {"*": {key: table[key] for key in STATED_KEYS if key in table}}
    first = read_stated(str(path), "*", parts["*"])
    return (first, *(read_stated(f"{path}: logs.{p}", p, row) for p, row in logs.items()))


def read_dialect(path: Path, table: Mapping[str, Any]) -> CsvDialect:
    """Return what is said of the form of CSV files."""
    delimiter, decimal = table.get("delimiter"), table.get("decimal")
    if delimiter is not None and (
        not isinstance(delimiter, str) or len(delimiter) != 1 or delimiter in '"\n\r'
    ):
        raise InvalidMapping(
            f"{path}: delimiter must be one character, such as ';'; it is {shown(delimiter)}"
        )
    if decimal not in (None, ".", ","):
        raise InvalidMapping(f"{path}: decimal must be '.' or ','; it is {shown(decimal)}")
    header = read_names(path, "header", table)
    comment = word(path, "comment", table.get("comment"))
    return CsvDialect(delimiter=delimiter, decimal=decimal, comment=comment, header=header)


def read_names(path: Path, key: str, table: Mapping[str, Any]) -> tuple[str, ...]:
    """Return a list of names, empty where it is not given."""
    names = table.get(key, [])
    if not are_words(names):
        raise InvalidMapping(f"{path}: {key} must be a list of names; it is {shown(names)}")
    return tuple(names)


def positive(path: Path, key: str, value: Any) -> float:
    """Return a positive number."""
    number = finite_number(value)
    if number is None or number <= 0.0:
        raise InvalidMapping(f"{path}: {key} must be a positive number; it is {shown(value)}")
    return number


def read_stated(where: str, pattern: str, table: Mapping[str, Any]) -> StatedNumbers:
    """Read what is stated of the logs whose names match a pattern."""
    refuse_unknown_keys(table, STATED_KEYS, where, InvalidMapping)
    try:
        overrides = read_bench_overrides(table.get("bench_overrides", {}))
    except TendonNewtonError as error:
        raise InvalidMapping(f"{where}: {error}") from error
    stated = CheckedTable(table, where, InvalidMapping)
    if "load_cell_rate" in stated and stated.number("load_cell_rate") <= 0.0:
        stated.refuse("load_cell_rate", "a positive number")
    return stated.record(StatedNumbers, pattern=pattern, bench_overrides=overrides)
