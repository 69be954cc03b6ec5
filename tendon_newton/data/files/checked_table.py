"""Dataclasses as tables of files, and tables read with errors that name place and promise."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, Field, fields, is_dataclass
from pathlib import Path
from types import NoneType
from typing import Any, Literal, NoReturn, TypeVar, cast, get_args, get_origin, get_type_hints

from tendon_newton.data.files.json_file import read_json
from tendon_newton.data.files.text_file import finite_number
from tendon_newton.data.files.values import are_tables, are_words, is_list, is_table
from tendon_newton.errors import TendonNewtonError, listed, shown

Record = TypeVar("Record", bound=Any)  # A dataclass
# Metadata of a field that has a default, and that a file must have nevertheless
STATED = {"stated": True}


class CheckedTable:
    """An object whose values are asked for by key and kind; one of another kind is refused."""

    def __init__(
        self, values: Mapping[str, Any], where: str, fault: type[TendonNewtonError]
    ) -> None:
        self.values = values
        self.where = where
        self._fault = fault

    def __contains__(self, key: str) -> bool:
        return key in self.values

    def number(self, key: str) -> float:
        """Return the finite number under a key."""
        number = finite_number(self.values.get(key))
        return self.refuse(key, "a finite number") if number is None else number

    def whole(self, key: str) -> int:
        """Return the whole number under a key."""
        number = self.values.get(key)
        if isinstance(number, bool) or not isinstance(number, int):
            self.refuse(key, "a whole number")
        return number

    def vector(self, key: str, count: int) -> tuple[float, ...]:
        """Return so many finite numbers under a key."""
        value = self.values.get(key)
        numbers = [finite_number(each) for each in value] if is_list(value) else []
        known = tuple(number for number in numbers if number is not None)
        if not len(known) == len(numbers) == count:
            self.refuse(key, f"{count} finite numbers")
        return known

    def pair(self, key: str) -> tuple[float, float]:
        """Return the two finite numbers under a key."""
        first, second = self.vector(key, 2)
        return first, second

    def flag(self, key: str) -> bool:
        """Return the truth value under a key."""
        flag = self.values.get(key)
        return flag if isinstance(flag, bool) else self.refuse(key, "true or false")

    def word(self, key: str) -> str:
        """Return the text under a key."""
        word = self.values.get(key)
        return word if isinstance(word, str) else self.refuse(key, "text")

    def words(self, key: str) -> tuple[str, ...]:
        """Return the texts under a key."""
        words = self.values.get(key)
        return tuple(words) if are_words(words) else self.refuse(key, "a list of names")

    def record(self, kind: type[Record], **known: Any) -> Record:
        """Return a dataclass, each of whose fields is read from the key of its name by its type.

        A field's metadata may have another `key`. Without its key a field has its default, unless
        its metadata are `STATED`; what has no default is None where it may be.

        Args:
            **known: Fields that are not read.
        """
        types = get_type_hints(kind)
        for field in fields(kind):
            key = field.metadata.get("key", field.name)
            if field.name in known:
                continue
            if key not in self and "stated" in field.metadata:
                self.refuse(key, "stated")
            if key in self or default_of(field) is MISSING:
                known[field.name] = self.value(key, types[field.name])
        return kind(**known)

    def value(self, key: str, kind: Any) -> Any:
        """Return what stands under a key, of a type as a dataclass states it."""
        readers: dict[Any, Any] = {
            float: self.number,
            int: self.whole,
            bool: self.flag,
            str: self.word,
            tuple[str, ...]: self.words,
            Mapping[str, float]: self.numbers,
        }
        origin, inner = get_origin(kind), get_args(kind)
        if kind in readers:
            return readers[kind](key)
        if isinstance(kind, type) and is_dataclass(kind):
            return self.table(key).record(kind)
        if NoneType in inner:
            return None if self.values.get(key) is None else self.value(key, inner[0])
        if origin is Literal:
            value = self.values.get(key)
            return value if value in inner else self.refuse(key, f"one of {listed(inner)}")
        if origin is Mapping:
            table = self.table(key)
            return {name: table.value(name, inner[1]) for name in table.values}
        if all(part is float for part in inner):
            return self.vector(key, len(inner))
        rows: type[Any] = inner[0]
        return tuple(row.record(rows) for row in self.tables(key))

    def numbers(self, key: str) -> dict[str, float]:
        """Return the finite numbers by name under a key."""
        table = self.values.get(key)
        if is_table(table):
            known = {
                k: number for k, v in table.items() if (number := finite_number(v)) is not None
            }
            if len(known) == len(table):
                return known
        self.refuse(key, "an object of finite numbers")

    def table(self, key: str, *, hint: str = "") -> CheckedTable:
        """Return the object under a key.

        Args:
            hint: What to do where there is none, a sentence.
        """
        table = self.values.get(key)
        if not is_table(table):
            self.refuse(key, "an object", hint)
        return CheckedTable(table, self.place(key), self._fault)

    def tables(self, key: str, *, hint: str = "") -> list[CheckedTable]:
        """Return the objects in the list under a key.

        Args:
            hint: What to do where there is no such list, a sentence.
        """
        tables = self.values.get(key)
        if not are_tables(tables):
            self.refuse(key, "a list of objects", hint)
        return [
            CheckedTable(table, f"{self.place(key)}[{index}]", self._fault)
            for index, table in enumerate(tables)
        ]

    def refuse(self, key: str, promise: str, hint: str = "") -> NoReturn:
        """Refuse what stands under a key."""
        came = (
            shown(self.values[key]) if key in self else f"missing, there are {listed(self.values)}"
        )
        end = f". {hint}" if hint else ""
        raise self._fault(f"{self.place(key)} must be {promise}; it is {came}{end}")

    def place(self, key: str) -> str:
        """Return where a key stands, as a message shows it: its name may hold anything."""
        name = key if key.isidentifier() else shown(key)
        return f"{self.where}: {name}" if self.where else name


def read_checked(path: Path, fault: type[TendonNewtonError], promise: str) -> CheckedTable:
    """Read the object of a JSON file; see `read_json`."""
    return CheckedTable(read_json(path, fault, promise), str(path), fault)


def table_of(value: Any) -> Any:
    """Return a dataclass as `CheckedTable.record` reads it; defaults are left out."""
    if is_dataclass(value):
        return {
            field.metadata.get("key", field.name): table_of(getattr(value, field.name))
            for field in fields(value)
            if "stated" in field.metadata or getattr(value, field.name) != default_of(field)
        }
    if isinstance(value, Mapping):
        return {key: table_of(each) for key, each in cast("Mapping[str, Any]", value).items()}
    if isinstance(value, tuple):
        return [table_of(each) for each in cast("tuple[Any, ...]", value)]
    return value


def default_of(field: Field[Any]) -> Any:
    """Return a field's default, `MISSING` where it has none."""
    factory = field.default_factory
    return field.default if factory is MISSING else factory()
