"""TOML files as tables, with errors that name the file."""

import tomllib
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import tomli_w

from tendon_newton.errors import TendonNewtonError


def read_toml(path: Path, fault: type[TendonNewtonError]) -> dict[str, Any]:
    """Read a TOML file, raising ``fault`` with the place where it is broken."""
    try:
        return tomllib.loads(path.read_bytes().decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        raise fault(f"{path}: must be UTF-8 text; byte {error.start} is not") from error
    except tomllib.TOMLDecodeError as error:
        raise fault(f"{path}: must be TOML: {error}") from error


def write_toml(path: Path, table: Mapping[str, Any], **rows: Sequence[Mapping[str, Any]]) -> None:
    """Write a table and arrays of tables below it; floats keep every bit.

    Args:
        path: File to write.
        table: Keys that stand at the top.
        rows: Arrays of tables by name. They are written as ``[[name]]`` blocks, to which a user
            can append: the writer alone would put short ones into brackets on a line.
    """
    blocks = [tomli_w.dumps(table)] if table else []
    for name, tables in rows.items():
        for row in tables:
            nested = {key: value for key, value in row.items() if isinstance(value, Mapping)}
            flat = {key: value for key, value in row.items() if key not in nested}
            below = "\n" + tomli_w.dumps({name: nested}) if nested else ""
            blocks.append(f"[[{name}]]\n{tomli_w.dumps(flat)}{below}")
    path.write_text("\n".join(blocks), encoding="utf-8")


def refuse_unknown_keys(
    table: Mapping[str, Any], known: Iterable[str], where: str, fault: type[TendonNewtonError]
) -> None:
    """Refuse keys outside a list, naming the list: a misspelt key must not be ignored."""
    known = list(known)
    for key in table:
        if key not in known:
            raise fault(f"{where}: no key named {key!r}; known: {', '.join(known)}")
