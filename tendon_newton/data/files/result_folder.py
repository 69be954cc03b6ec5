"""Steps that several verbs take before they write."""

from __future__ import annotations

from pathlib import Path

from tendon_newton.errors import InvalidOutput


def make_folder(path: Path) -> Path:
    """Make a folder for results, parents included.

    Raises:
        InvalidOutput: Something else is in the way, or it may not be made.
    """
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InvalidOutput(f"{path}: results need a folder; {error.strerror or error}") from error
    return path
