"""Columns of a mapping file: unit, sign and zero of theirs, or a topic."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from math import pi
from pathlib import Path

from tendon_newton.data.files.checked_table import CheckedTable
from tendon_newton.data.files.toml_file import read_toml, refuse_unknown_keys
from tendon_newton.data.formats.csv_columns import INDEX
from tendon_newton.data.formats.topic_mapping import COLUMNS, TopicMapping, TopicSource
from tendon_newton.errors import InvalidMapping, shown, unknown_name

DEGREE = pi / 180.0
RPM = 2.0 * pi / 60.0
ANGLE = {
    "rad": 1.0,
    "mrad": 1.0e-3,
    "deg": DEGREE,
    "degrees": DEGREE,
    "°": DEGREE,
    "turn": 2.0 * pi,
    "rev": 2.0 * pi,
}
SPEED = {
    "rad/s": 1.0,
    "mrad/s": 1.0e-3,
    "deg/s": DEGREE,
    "°/s": DEGREE,
    "rev/min": RPM,
    "rpm": RPM,
    "rev/s": 2.0 * pi,
}
TORQUE = {"N m": 1.0, "Nm": 1.0, "mN m": 1.0e-3, "mNm": 1.0e-3, "kgf cm": 9.80665e-2}
FORCE = {
    "N": 1.0,
    "mN": 1.0e-3,
    "kN": 1.0e3,
    "g": 9.80665e-3,
    "kg": 9.80665,
    "gf": 9.80665e-3,
    "kgf": 9.80665,
    "lbf": 4.4482216,
    **TORQUE,
}
LENGTH = {"m": 1.0, "cm": 1.0e-2, "mm": 1.0e-3}
UNITS: dict[str, dict[str, float]] = {
    "t": {
        "s": 1.0,
        "ms": 1.0e-3,
        "us": 1.0e-6,
        "µs": 1.0e-6,
        "ns": 1.0e-9,
        "min": 60.0,
        "h": 3600.0,
        "d": 86400.0,  # a spreadsheet's date and time
    },
    "theta_d": ANGLE,
    "theta": ANGLE,
    "theta_dot": SPEED,
    "force": FORCE,
    "joint_angle": ANGLE,
    "joint_load": TORQUE,
    "tip_x": LENGTH,
    "tip_z": LENGTH,
    "current": {"A": 1.0, "mA": 1.0e-3},
    "voltage": {"V": 1.0, "mV": 1.0e-3},
    "temperature": {"degC": 1.0, "°C": 1.0},
    "enabled": {"1": 1.0},
}
"""Column of ours -> unit of theirs -> its size in ours."""
OF_A_SERVO = re.compile(
    rf"(theta_d|theta|theta_dot|force|joint_angle|current|voltage|temperature)_({INDEX})"
)
"""Column of one of several servos: ours, and its number from 0."""
SIZE_KEYS = ("unit", "scale", "sign", "offset")
COLUMN_KEYS = ("column", *SIZE_KEYS, "derive")
TOPIC_KEYS = ("topic", "field", "joints", *SIZE_KEYS, "derive")
DERIVED = "theta"  # What a speed may be derived from where none was logged


@dataclass(frozen=True, kw_only=True)
class MappedColumn:
    """Source of one column, and its conversion to ours."""

    # Foreign column, or a path such as ``state.position[2]``; None for a derived speed
    source: str | None
    scale: float = 1.0  # Our unit per theirs, with the sign
    offset: float = 0.0  # Our value where theirs is zero


def read_column(name: str, table: CheckedTable) -> MappedColumn | TopicSource:
    """Read the table of one column, a column or path of theirs or a topic and a field."""
    where, row = table.where, table.values
    of_a_servo = OF_A_SERVO.fullmatch(name)
    kind = of_a_servo[1] if of_a_servo else name
    if kind not in UNITS:
        raise InvalidMapping(f"{where}: {unknown_name('column', name, UNITS)}")
    by_topic = "topic" in row
    if by_topic and of_a_servo:
        raise InvalidMapping(
            f"{where}: a topic gives the servos of {kind} in one column: joints lists their names"
        )
    refuse_unknown_keys(row, TOPIC_KEYS if by_topic else COLUMN_KEYS, where, InvalidMapping)
    if "derive" in row:
        if kind != "theta_dot" or row["derive"] != DERIVED or len(row) > 1:
            raise InvalidMapping(
                f'{where}: only theta_dot = {{derive = "theta"}} can be derived; it is {shown(row)}'
            )
        return MappedColumn(source=None)
    scale, offset = read_size(kind, table)
    if by_topic:
        names = table.words("joints") if "joints" in table else ()
        topic, field = table.word("topic"), table.word("field")
        try:
            return TopicSource(topic=topic, field=field, joints=names, scale=scale, offset=offset)
        except InvalidMapping as error:
            raise InvalidMapping(f"{where}: {error}") from error
    if not isinstance(row.get("column"), str):
        raise InvalidMapping(
            f"{where}: column must name one of theirs, or topic and field a value in ROS 2 "
            f"messages; it is {shown(row)}"
        )
    return MappedColumn(source=row["column"], scale=scale, offset=offset)


def read_size(name: str, row: CheckedTable) -> tuple[float, float]:
    """Read scale, with the sign, and offset of a column."""
    where = row.where
    if "unit" in row and "scale" in row:
        raise InvalidMapping(f"{where}: give a unit or a scale, not both")
    unit = row.word("unit") if "unit" in row else next(iter(UNITS[name]))
    if unit in UNITS["current"] and name == "force":
        raise InvalidMapping(
            f"{where}: {unit} is a current: give scale = N m per {unit}, the torque constant times "
            "the gear, in place of the unit"
        )
    if unit not in UNITS[name]:
        raise InvalidMapping(f"{where}: {unknown_name('unit', unit, UNITS[name])}")
    sign = row.values.get("sign", 1)
    if sign not in (1, -1):
        row.refuse("sign", "1 or -1")
    scale = row.number("scale") if "scale" in row else UNITS[name][unit]
    if scale == 0.0:
        row.refuse("scale", "a number that is not 0")
    return sign * scale, row.number("offset") if "offset" in row else 0.0


TOPIC_FILE_KEYS = ("clock", "columns")
"""Keys of a mapping that a dataset names; ``dataset.toml`` states bench, start and numbers."""
Columns = Mapping[str, MappedColumn | TopicSource]


def read_topic_mapping(path: Path) -> TopicMapping:
    """Read the mapping of a recording that a dataset lists.

    Raises:
        InvalidMapping: A key is missing, unknown, or has a value of the wrong kind.
    """
    read = read_toml(path, InvalidMapping, "a mapping is a TOML file")
    if bare := [column for column in COLUMNS if column in read]:
        raise InvalidMapping(f"{path}: {bare[0]} must stand under [columns]; it stands alone")
    refuse_unknown_keys(read, TOPIC_FILE_KEYS, str(path), InvalidMapping)
    table = CheckedTable({"columns": {}, **read}, str(path), InvalidMapping)
    topics = read_topics(path, read_columns(table), word(table, "clock"))
    if topics is None:
        raise InvalidMapping(
            f"{path}: columns must say topic and field of what a ROS 2 recording holds; none does"
        )
    return topics


def read_columns(table: CheckedTable) -> Columns:
    """Read where every column comes from."""
    hint = 'It has one per column of ours, as t = {column = "time_s"}'
    columns = table.table("columns", hint=hint)
    return {name: read_column(name, columns.table(name, hint=hint)) for name in columns.values}


def read_topics(path: Path, mapped: Columns, clock: str | None) -> TopicMapping | None:
    """Return the mapping of a ROS 2 recording's topics; None where no column is on a topic."""
    sources = {name: column for name, column in mapped.items() if isinstance(column, TopicSource)}
    if not sources:
        return None
    others = {n for n, column in mapped.items() if getattr(column, "source", None) is not None}
    if others:
        raise InvalidMapping(
            f"{path}: columns are all in files of rows or all on topics; {min(others)} is a "
            f"column and {min(sources)} on a topic"
        )
    if "t" in mapped:
        raise InvalidMapping(
            f"{path}: the time of a ROS 2 recording is that of its messages, by their stamps or "
            'by when they were recorded (clock = "log"); leave t out'
        )
    return TopicMapping(
        sources=sources,
        differentiate="theta_dot" in mapped and "theta_dot" not in sources,
        clock=clock or "header",
        path=path,
    )


def word(table: CheckedTable, key: str) -> str | None:
    """Return a word, None where it is not given."""
    found: str | None = table.value(key, str | None)
    return table.refuse(key, "a word") if found == "" else found
