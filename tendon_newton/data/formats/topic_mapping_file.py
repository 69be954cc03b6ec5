"""A mapping of topics to columns as a TOML file; see ``docs/recordings.md``."""

from pathlib import Path
from typing import Any

from tendon_newton.data.files.text_file import finite_number
from tendon_newton.data.files.toml_file import read_toml, refuse_unknown_keys
from tendon_newton.data.files.values import are_words, is_table
from tendon_newton.data.formats.topic_mapping import COLUMNS, Source, TopicMapping
from tendon_newton.errors import InvalidMapping, shown

SOURCE_KEYS = ("topic", "field", "joints", "scale", "offset", "differentiate")


def read_mapping(path: Path) -> TopicMapping:
    """Read a mapping file.

    Raises:
        InvalidMapping: A key is missing, unknown, or has a value of the wrong kind.
    """
    table = read_toml(path, InvalidMapping, "a mapping is a TOML file")
    refuse_unknown_keys(table, ("clock", *COLUMNS), str(path), InvalidMapping)
    clock = table.pop("clock", "header")
    sources: dict[str, Source] = {}
    differentiate = False
    for column, entry in table.items():
        where = f"{path}: [{column}]"
        if not is_table(entry):
            raise InvalidMapping(f"{where} must be a table; it is {shown(entry)}")
        refuse_unknown_keys(entry, SOURCE_KEYS, where, InvalidMapping)
        if "differentiate" in entry:
            check_differentiate(column, entry, where)
            differentiate = True
        else:
            sources[column] = read_source(entry, where)
    return TopicMapping(sources=sources, differentiate=differentiate, clock=clock, path=path)


def check_differentiate(column: str, entry: dict[str, Any], where: str) -> None:
    """Refuse a derived column other than theta_dot from theta."""
    if column != "theta_dot" or entry != {"differentiate": "theta"}:
        raise InvalidMapping(
            f'{where}: only theta_dot can be derived, by differentiate = "theta" alone; '
            f"it says {shown(entry)}"
        )


def read_source(entry: dict[str, Any], where: str) -> Source:
    """Read one column's table."""
    for key in ("topic", "field"):
        if not isinstance(entry.get(key), str) or not entry[key]:
            raise InvalidMapping(f"{where}: {key} must be a string; it is {shown(entry.get(key))}")
    joints = entry.get("joints", [])
    if not are_words(joints):
        raise InvalidMapping(f"{where}: joints must be a list of names; it is {shown(joints)}")
    numbers = {"scale": entry.get("scale", 1.0), "offset": entry.get("offset", 0.0)}
    for key, value in numbers.items():
        if finite_number(value) is None:
            raise InvalidMapping(f"{where}: {key} must be a finite number; it is {shown(value)}")
    try:
        return Source(
            topic=entry["topic"],
            field=entry["field"],
            joints=tuple(joints),
            scale=float(numbers["scale"]),
            offset=float(numbers["offset"]),
        )
    except InvalidMapping as error:
        raise InvalidMapping(f"{where}: {error}") from error
