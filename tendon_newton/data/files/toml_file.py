"""TOML files as tables, with errors that name the file."""

import re
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import tomli_w

from tendon_newton.data.files.text_file import SIZE_LIMIT, read_text, write_text
from tendon_newton.errors import TendonNewtonError, listed, near, shown

KEY_PARTS = 32
"""Most parts of a dotted key, as in ``a.b.c``. The parser takes time with their square."""
KEY = r"""(?:[A-Za-z0-9_-]++|"[^"\n]*+"|'[^'\n]*+')"""
LONG_KEY = re.compile(rf"(?<![A-Za-z0-9_.-]){KEY}(?:[ \t]*+\.[ \t]*+{KEY}){{{KEY_PARTS},}}+")
MESSAGE_LENGTH = 300  # Longest message of the parser that is repeated in full [characters]


def read_toml(
    path: Path, fault: type[TendonNewtonError], promise: str = "must be a TOML file"
) -> dict[str, Any]:
    """Read a TOML file, raising ``fault`` with the place where it is broken.

    Args:
        promise: What the file should be, in words ("a model is a TOML file").
    """
    text = read_text(path, fault, promise, size_limit=SIZE_LIMIT)
    if (key := LONG_KEY.search(text)) is not None:
        line = text.count("\n", 0, key.start()) + 1
        raise fault(
            f"{path}: {promise}; line {line} has a name of more than {KEY_PARTS} parts with dots "
            "between them"
        )
    try:
        return tomllib.loads(text)
    except RecursionError as error:
        raise fault(f"{path}: {promise}; its values are nested too deeply") from error
    except ValueError as error:  # TOMLDecodeError is one, and so is what int() raises
        raise fault(f"{path}: must be TOML: {shortened(error)}") from error


def shortened(error: ValueError) -> str:
    """Return what the parser says, without the kilobytes of a name that it may repeat."""
    text = str(error)
    return text if len(text) <= MESSAGE_LENGTH else f"{text[:100]} ... {text[-100:]}"


def write_toml(path: Path, table: Mapping[str, Any], **rows: Sequence[Mapping[str, Any]]) -> None:
    """Write a table and arrays of tables below it; floats keep every bit.

    Args:
        rows: Arrays of tables by name. Arrays are written as ``[[name]]`` blocks, to which a user
            can append: the writer alone would put short ones into brackets on a line.

    Raises:
        InvalidOutput: The disk does not take it; what was there before stays.
    """
    blocks = [tomli_w.dumps(table)] if table else []
    for name, tables in rows.items():
        for row in tables:
            nested: dict[str, Any] = {
                key: value for key, value in row.items() if isinstance(value, Mapping)
            }
            flat = {key: value for key, value in row.items() if key not in nested}
            below = "\n" + tomli_w.dumps({name: nested}) if nested else ""
            blocks.append(f"[[{name}]]\n{tomli_w.dumps(flat)}{below}")
    write_text(path, "\n".join(blocks))


def refuse_unknown_keys(
    table: Mapping[str, Any], known: Iterable[str], where: str, fault: type[TendonNewtonError]
) -> None:
    """Refuse keys outside a list, naming the list: a misspelt key must not be ignored."""
    known = list(known)
    for key in table:
        if key not in known:
            hint = near(key, known)
            raise fault(f"{where}: no key named {shown(key)}; {hint}known: {listed(known)}")
