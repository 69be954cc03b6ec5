"""How somebody's CSV file separates cells and writes decimals, where the mapping does not say."""

import csv
import re
from collections.abc import Collection, Iterable
from dataclasses import dataclass, replace
from itertools import chain, islice
from pathlib import Path

from tendon_newton.data.files.text_file import LOG_SIZE_LIMIT, open_text
from tendon_newton.errors import InvalidRecording

DELIMITERS = (",", ";", "\t", "|")
LOOKED_AT = 100  # Rows from which the decimal mark is guessed
COMMA = re.compile(r"\s*[+-]?\d*,\d+(e[+-]?\d+)?\s*", re.IGNORECASE)
POINT = re.compile(r"\s*[+-]?\d*\.\d+(e[+-]?\d+)?\s*", re.IGNORECASE)
PROMISE = "a log is a CSV file with a header line"


@dataclass(frozen=True, kw_only=True)
class CsvDialect:
    """How cells are separated and decimals written."""

    delimiter: str | None = None  # None where it is to be guessed
    decimal: str | None = None  # ``.`` or ``,``; None where it is to be guessed
    comment: str | None = None  # What lines begin with that hold no row; None where there are none
    header: tuple[str, ...] = ()  # Names of the columns where no line has them

    def rows(self, lines: Iterable[str]) -> Iterable[str]:
        """Return the lines without comments, a header first."""
        mark = self.comment
        kept = lines if mark is None else (x for x in lines if not x.lstrip().startswith(mark))
        return chain([(self.delimiter or ",").join(self.header)], kept) if self.header else kept

    def guessed(self, path: Path, wanted: Collection[str]) -> "CsvDialect":
        """Return the dialect of a file, with what was not said guessed.

        The delimiter is the one with which the header has the most of the wanted columns, and of
        these the most cells. Decimals have commas where some wanted cell has one and none has a
        point; where commas separate cells as well, such a cell stands in quotes.
        """
        with open_text(path, InvalidRecording, PROMISE, size_limit=LOG_SIZE_LIMIT) as file:
            lines = list(islice(self.rows(file), LOOKED_AT + 1))
        if not lines:
            return replace(self, delimiter=self.delimiter or ",", decimal=self.decimal or ".")
        try:
            delimiter = self.delimiter or guess_delimiter(lines[0], wanted)
            decimal = self.decimal or guess_decimal(lines, delimiter, wanted)
        except csv.Error as error:
            raise InvalidRecording(f"{path}: a log must be CSV: {error}") from error
        return replace(self, delimiter=delimiter, decimal=decimal)

    def text(self, given: "CsvDialect") -> str:
        """Say what of this was guessed; empty where it is what any program expects."""
        words: list[str] = []
        if given.delimiter is None and self.delimiter != ",":
            words.append(f"cells separated by {self.delimiter!r}")
        if given.decimal is None and self.decimal != ".":
            words.append("decimal commas")
        return " and ".join(words)


def guess_delimiter(header: str, wanted: Collection[str]) -> str:
    """Return what separates the cells of a header line."""

    def score(delimiter: str) -> tuple[int, int]:
        cells = {cell.strip() for row in csv.reader([header], delimiter=delimiter) for cell in row}
        return len(cells & set(wanted)), len(cells)

    return max(DELIMITERS, key=score)


def guess_decimal(lines: list[str], delimiter: str, wanted: Collection[str]) -> str:
    """Return the decimal mark of the wanted cells."""
    rows = csv.DictReader(lines, skipinitialspace=True, delimiter=delimiter)
    cells = [row[name] for row in rows for name in wanted if isinstance(row.get(name), str)]
    commas = any(COMMA.fullmatch(cell) for cell in cells)
    points = any(POINT.fullmatch(cell) for cell in cells)
    return "," if commas and not points else "."
