"""Errors, named as facts: what was promised, what came, where."""

import difflib
from collections.abc import Iterable


class TendonNewtonError(Exception):
    """Base of every error that a user can cause and mend; the command line prints its message."""


class InvalidRecording(TendonNewtonError):
    """A recording breaks what its format promises."""


class InvalidDataset(TendonNewtonError):
    """A dataset folder or its ``dataset.toml`` breaks what the format promises."""


class InvalidModelFile(TendonNewtonError):
    """A model file breaks what its format promises."""


class InvalidAsset(TendonNewtonError):
    """A bench's USD asset lacks something or contradicts itself."""


class UnknownName(TendonNewtonError):
    """A name stands in none of our tables."""


class InvalidParameter(TendonNewtonError):
    """A number lies outside what it can mean."""


class SimulationDiverged(TendonNewtonError):
    """A simulated state left every physical range."""


class MissingDependency(TendonNewtonError):
    """A verb needs a package that is not installed."""


class InvalidOutput(TendonNewtonError):
    """The place to write to cannot take the result."""


def unknown_name(kind: str, name: str, known: Iterable[str]) -> UnknownName:
    """Build the error for a name outside a table.

    Args:
        kind: What the table holds, in words ("effect").
        name: The name that came.
        known: The names in the table.
    """
    names = sorted(known)
    close = difflib.get_close_matches(name, names, n=1)
    hint = f"; did you mean {close[0]!r}?" if close else ""
    return UnknownName(f"No {kind} named {name!r}; known: {', '.join(names) or 'none'}{hint}")
