"""What installed packages add to the tables of verbs, log formats and export targets.

A package names each in its own ``pyproject.toml``, as an entry point of one of the groups below.
Nothing of it is imported before a user names what it adds; the names themselves are read from the
metadata of what is installed.
"""

from collections.abc import Collection
from importlib.metadata import EntryPoint, entry_points
from typing import Any

from tendon_newton.errors import InvalidPlugIn

VERBS = "tendon_newton.verbs"
"""A module whose ``main(config: Config) -> None`` runs the verb; its docstring is the help."""
IMPORTERS = "tendon_newton.importers"
"""A function from a path to an ``Imported``."""
EXPORTS = "tendon_newton.exports"
"""An ``ExportTarget``."""


def added(group: str, own: Collection[str]) -> dict[str, EntryPoint]:
    """Return what installed packages add to a table of ours, by name.

    Args:
        group: One of the groups above.
        own: Names that are taken.

    Raises:
        InvalidPlugIn: A name is ours or another package's.
    """
    rows: dict[str, EntryPoint] = {}
    for entry in entry_points(group=group):
        if entry.name in own or entry.name in rows:
            other = package(rows[entry.name]) if entry.name in rows else "our own package"
            raise InvalidPlugIn(
                f"{package(entry)}: {entry.name!r} of {group} must be a new name; {other} has it: "
                "uninstall one of the two packages, or rename its entry point"
            )
        rows[entry.name] = entry
    return rows


def load(entry: EntryPoint) -> Any:
    """Import what an entry point names.

    Raises:
        InvalidPlugIn: It cannot be imported.
    """
    try:
        return entry.load()
    except Exception as error:  # anything may happen in a stranger's module
        raise InvalidPlugIn(
            f"{package(entry)}: {entry.value} of {entry.group} must be importable; it ends with "
            f"{type(error).__name__}: {error}"
        ) from error


def package(entry: EntryPoint) -> str:
    """Name the installed package that an entry point came with."""
    return "a package" if entry.dist is None else f"package {entry.dist.name}"
