"""Text files: reading those from outside without trusting them, and writing ours whole."""

import os
from math import isfinite
from pathlib import Path
from typing import Any

from tendon_newton.errors import InvalidOutput, TendonNewtonError

SIZE_LIMIT = 4_000_000
"""Bytes of a settings file that we read; the largest of ours, a dataset of thousands of recordings,
has a tenth of it, and parsing more would look like a hang."""


def read_text(
    path: Path, fault: type[TendonNewtonError], promise: str, *, size_limit: int | None = None
) -> str:
    """Read a UTF-8 text file; a byte order mark at its start is left out.

    Args:
        path: The file.
        fault: Error to raise where there is no such text.
        promise: What the file should be, in words ("a model is a TOML file").
        size_limit: Bytes beyond which the file cannot be what it should be.
    """
    try:
        if not path.is_file():
            raise fault(f"{path}: {promise}; {absence(path)}")
        size = path.stat().st_size
        if size_limit is not None and size > size_limit:
            raise fault(f"{path}: {promise} of at most {size_limit} bytes; it has {size}")
        text = path.read_bytes().decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise fault(f"{path}: {promise}, which must be UTF-8; byte {error.start} is not") from error
    except OSError as error:
        raise fault(f"{path}: {promise}; it cannot be read: {error.strerror or error}") from error
    if "\0" in text:
        raise fault(f"{path}: {promise}; it holds a zero byte at character {text.index(chr(0))}")
    return text


def write_text(path: Path, text: str) -> None:
    """Write a UTF-8 text file whole or not at all: a full disk leaves what was there before.

    Raises:
        InvalidOutput: It cannot be written; the message names it.
    """
    beside = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        try:
            with beside.open("w", encoding="utf-8") as file:
                file.write(text)
                file.flush()
                os.fsync(file.fileno())  # else a power cut may leave a name without its content
            beside.replace(path)
        finally:
            beside.unlink(missing_ok=True)
    except OSError as error:
        raise InvalidOutput(f"{path}: cannot be written: {error.strerror or error}") from error


def absence(path: Path) -> str:
    """Say what stands in a file's place."""
    if path.is_dir():
        return "it is a folder"
    if path.parent.is_dir():
        return "no such file" if not path.exists() else "it is a device or a pipe"
    return f"{path.parent} is a file, no folder" if path.parent.is_file() else "no such folder"


def finite_number(value: Any) -> float | None:
    """Return a value as a float; None if it is no number, not finite or beyond any float."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    try:
        number = float(value)
    except OverflowError:
        return None
    return number if isfinite(number) else None
