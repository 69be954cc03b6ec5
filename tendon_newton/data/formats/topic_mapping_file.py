"""A mapping of topics to columns as a TOML file; see ``docs/recordings_mapping.md``."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tendon_newton.data.files.toml_file import read_toml, refuse_unknown_keys
from tendon_newton.data.files.values import are_tables, is_table
from tendon_newton.data.formats.mapped_column import MappedColumn, read_column
from tendon_newton.data.formats.topic_mapping import COLUMNS, TopicMapping, TopicSource
from tendon_newton.errors import InvalidMapping, shown

TOPIC_FILE_KEYS = ("clock", "columns")
"""Keys of a mapping that a dataset names; ``dataset.toml`` states bench, start and numbers."""
Columns = Mapping[str, MappedColumn | TopicSource]


def read_topic_mapping(path: Path) -> TopicMapping:
    """Read the mapping of a recording that a dataset lists.

    Raises:
        InvalidMapping: A key is missing, unknown, or has a value of the wrong kind.
    """
    table = read_toml(path, InvalidMapping, "a mapping is a TOML file")
    if bare := [column for column in COLUMNS if column in table]:
        raise InvalidMapping(f"{path}: {bare[0]} must stand under [columns]; it stands alone")
    refuse_unknown_keys(table, TOPIC_FILE_KEYS, str(path), InvalidMapping)
    topics = read_topics(path, read_columns(path, table.get("columns", {})), table.get("clock"))
    if topics is None:
        raise InvalidMapping(
            f"{path}: columns must say topic and field of what a ROS 2 recording holds; none does"
        )
    return topics


def read_columns(path: Path, columns: Any) -> Columns:
    """Read where every column comes from."""
    if not is_table(columns) or not are_tables([*columns.values()]):
        raise InvalidMapping(f"{path}: columns must hold one table per column of ours")
    return {name: read_column(f"{path}: columns.{name}", name, r) for name, r in columns.items()}


def read_topics(path: Path, mapped: Columns, clock: Any) -> TopicMapping | None:
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
        clock=word(path, "clock", clock) or "header",
        path=path,
    )


def word(path: Path, key: str, value: Any) -> str | None:
    """Return a word, None where it is not given."""
    if value is not None and not (isinstance(value, str) and value):
        raise InvalidMapping(f"{path}: {key} must be a word; it is {shown(value)}")
    return value
