"""Errors, named as facts: what was promised, what came, where."""

import difflib
import re
import reprlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import islice
from typing import Any, NoReturn, TypeVar

Entry = TypeVar("Entry")

SHOWN_LENGTH = 80  # Longest value that a message repeats in full [characters]
SHOWN_NAMES = 40  # Most names that a message lists
SHOWN_WORD = 1100  # Longest word that stays whole, whoever built the message: a path [characters]


class TendonNewtonError(Exception):
    """Base of every error that a user can cause and mend; the command line prints its message."""

    def __str__(self) -> str:
        """Return the message, in which a file's endless word is cut."""
        cut = rf"(\S{{{SHOWN_LENGTH}}})\S{{{SHOWN_WORD - 2 * SHOWN_LENGTH},}}(\S{{{SHOWN_LENGTH}}})"
        return re.sub(cut, r"\1...\2", super().__str__())


class InvalidRecording(TendonNewtonError):
    """A recording breaks what its format promises."""


class InvalidDataset(TendonNewtonError):
    """A dataset folder or its ``dataset.toml`` breaks what the format promises."""


class InvalidMapping(TendonNewtonError):
    """A mapping of topics to columns breaks what its format promises."""


class InvalidModelFile(TendonNewtonError):
    """A model file breaks what its format promises."""


class InvalidDiagnosis(TendonNewtonError):
    """A ``diagnosis.json`` breaks what the format promises."""


class NothingToSeparate(TendonNewtonError):
    """A diagnosis told all its causes apart, or names none."""


class InvalidAsset(TendonNewtonError):
    """A bench's USD asset lacks something or contradicts itself."""


class UnknownName(TendonNewtonError):
    """A name stands in none of our tables."""


class InvalidParameter(TendonNewtonError):
    """A number lies outside what it can mean."""


class InvalidDeviceCode(TendonNewtonError):
    """A device function asks a struct for what it does not have."""


class InvalidNetworkFile(TendonNewtonError):
    """A force network's file breaks what its format or its card promises."""


class UntrustedNetworkFile(TendonNewtonError):
    """A force network's file holds code that the user has not said to trust."""


class InvalidPolicyFile(TendonNewtonError):
    """A policy's file breaks what its format or its card promises."""


class InvalidGoal(TendonNewtonError):
    """What should be a policy's goal is none."""


class SimulationDiverged(TendonNewtonError):
    """A simulated state left every physical range."""


class MissingDependency(TendonNewtonError):
    """A verb needs a package that is not installed."""


class InvalidOutput(TendonNewtonError):
    """The place to write to cannot take the result."""


class InvalidPlugIn(TendonNewtonError):
    """What an installed package adds cannot be used."""


def unknown_name(kind: str, name: object, known: Iterable[str]) -> UnknownName:
    """Build the error for a name outside a table, whose kind is told in words ("effect")."""
    names = sorted(known)
    return UnknownName(f"No {kind} named {shown(name)}; {near(name, names)}known: {listed(names)}")


def near(name: object, known: Sequence[str]) -> str:
    """Return the question whether the nearest name was meant, with a space; empty without one."""
    close = difflib.get_close_matches(str(name)[:SHOWN_LENGTH], known, n=1)
    return f"did you mean {close[0]!r}? " if close else ""


def look_up(kind: str, name: str, table: Mapping[str, Entry]) -> Entry:
    """Return an entry of a table, whose kind is told in words ("effect").

    Raises:
        UnknownName: No such entry; the message lists the known ones.
    """
    if name not in table:
        raise unknown_name(kind, name, table)
    return table[name]


class NameTable(dict[str, Entry]):
    """A table of ours; an unknown name is refused with the known ones, as by `look_up`."""

    def __init__(self, kind: str, entries: Mapping[str, Entry]) -> None:
        super().__init__(entries)
        self.kind = kind

    def __missing__(self, name: str) -> NoReturn:
        """Refuse a name."""
        raise unknown_name(self.kind, name, self)


def require(
    settings: object, promise: str, holds: Callable[[Any], bool], names: Iterable[str]
) -> None:
    """Refuse settings of which one, by its name, is not what it "must be".

    Raises:
        InvalidParameter: The first one that is not.
    """
    for name in names:
        if not holds(value := getattr(settings, name)):
            raise InvalidParameter(f"{name} must {promise}; it is {value}")


def shown(value: Any) -> str:
    """Return a value as a message repeats it: as in Python, and cut where it is long or deep."""
    short = reprlib.Repr()
    short.maxstring = short.maxlong = short.maxother = SHOWN_LENGTH
    short.maxlevel = 3
    try:
        text = short.repr(value)
    except ValueError:  # an integer of more digits than Python writes
        return f"a {type(value).__name__} of more digits than can be shown"
    return text if len(text) <= 3 * SHOWN_LENGTH else f"{text[: 3 * SHOWN_LENGTH]}..."


def first_line(error: Exception) -> str:
    """Return the line of an engine's error that says what went wrong."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    return (lines[-1] if lines else type(error).__name__)[:200]


def listed(names: Iterable[str]) -> str:
    """Return names as a message lists them: separated by commas, and not all if they are many."""
    names = iter(names)
    first = [
        name if len(name) <= SHOWN_LENGTH else f"{name[:SHOWN_LENGTH]}..."
        for name in islice(names, SHOWN_NAMES)
    ]
    rest = sum(1 for _ in names)
    return ", ".join([*first, f"and {rest} more"] if rest else first) or "none"
