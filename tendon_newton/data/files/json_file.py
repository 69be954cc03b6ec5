"""JSON files as tables, with errors that name the file."""

import json
from pathlib import Path
from typing import Any, NoReturn

from tendon_newton.data.files.text_file import read_text, write_text
from tendon_newton.data.files.values import is_table
from tendon_newton.errors import TendonNewtonError, shown

SIZE_LIMIT = 64_000_000  # Bytes of a JSON file that we read


def read_json(
    path: Path, fault: type[TendonNewtonError], promise: str, *, size_limit: int = SIZE_LIMIT
) -> dict[str, Any]:
    """Read a JSON object, raising ``fault`` with the place where it is broken.

    NaN and Infinity, which Python writes and JSON does not have, are refused.

    Args:
        promise: What the file should be, in words ("a diagnosis is a JSON file").
        size_limit: Bytes beyond which the file cannot be what it should be.
    """
    text = read_text(path, fault, promise, size_limit=size_limit)
    try:
        table = json.loads(text, parse_constant=refuse_constant)
        json.dumps(table, ensure_ascii=False).encode()  # finds halves of surrogate pairs
    except RecursionError as error:
        raise fault(f"{path}: {promise}; its values are nested too deeply") from error
    except UnicodeEncodeError as error:
        raise fault(f"{path}: {promise}; it holds half of a character (as \\ud800)") from error
    except ValueError as error:  # JSONDecodeError is one, and so is what int() raises
        raise fault(f"{path}: {promise}, and must be JSON: {error}") from error
    if not is_table(table):
        raise fault(f"{path}: {promise} and holds an object, {{...}}; it is {shown(table)}")
    return table


def write_json(path: Path, table: Any) -> None:
    """Write a table whole or not at all, a key on each line."""
    write_text(path, json.dumps(table, indent=1) + "\n")


def refuse_constant(name: str) -> NoReturn:
    """Refuse a number that JSON does not have."""
    raise ValueError(f"{name} is not a number of JSON")
