"""Objects of JSON files, read key by key with errors that name the place and the promise."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NoReturn

from tendon_newton.data.files.json_file import read_json
from tendon_newton.data.files.text_file import finite_number
from tendon_newton.data.files.values import are_tables, are_words, is_list, is_table
from tendon_newton.errors import TendonNewtonError, listed, shown


class CheckedTable:
    """An object whose values are asked for by key and kind; one of another kind is refused.

    Args:
        where: Where it stands, for messages.
        fault: Error to raise.
    """

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

    def pair(self, key: str) -> tuple[float, float]:
        """Return the two finite numbers under a key."""
        pair = self.values.get(key)
        numbers = [finite_number(value) for value in pair] if is_list(pair) else []
        if len(numbers) != 2 or numbers[0] is None or numbers[1] is None:
            self.refuse(key, "two finite numbers")
        return numbers[0], numbers[1]

    def word_or_none(self, key: str) -> str | None:
        """Return the text under a key, None where null stands there."""
        return None if key in self and self.values[key] is None else self.word(key)

    def word(self, key: str) -> str:
        """Return the text under a key."""
        word = self.values.get(key)
        return word if isinstance(word, str) else self.refuse(key, "text")

    def words(self, key: str) -> tuple[str, ...]:
        """Return the texts under a key."""
        words = self.values.get(key)
        return tuple(words) if are_words(words) else self.refuse(key, "a list of names")

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

    def table(self, key: str, **absent: Any) -> CheckedTable:
        """Return the object under a key.

        Args:
            **absent: What holds for keys that the object does not have.
        """
        table = self.values.get(key)
        if not is_table(table):
            self.refuse(key, "an object")
        return CheckedTable(absent | table, f"{self.where}: {key}", self._fault)

    def tables(self, key: str, *, hint: str = "") -> list[CheckedTable]:
        """Return the objects in the list under a key.

        Args:
            hint: What to do where there is no such list, a sentence.
        """
        tables = self.values.get(key)
        if not are_tables(tables):
            self.refuse(key, "a list of objects", hint)
        return [
            CheckedTable(table, f"{self.where}: {key}[{index}]", self._fault)
            for index, table in enumerate(tables)
        ]

    def refuse(self, key: str, promise: str, hint: str = "") -> NoReturn:
        """Refuse what stands under a key."""
        came = (
            shown(self.values[key]) if key in self else f"missing, there are {listed(self.values)}"
        )
        end = f". {hint}" if hint else ""
        raise self._fault(f"{self.where}: {key} must be {promise}; it is {came}{end}")


def read_checked(path: Path, fault: type[TendonNewtonError], promise: str) -> CheckedTable:
    """Read the object of a JSON file; see `read_json`."""
    return CheckedTable(read_json(path, fault, promise), str(path), fault)
