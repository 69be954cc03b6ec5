"""How somebody's CSV file separates cells and writes decimals, where the mapping does not say."""

import csv
import re
from collections.abc import Collection, Iterable
from dataclasses import dataclass, replace
from itertools import chain, islice
from pathlib import Path

from tendon_newton.data.files.text_file import LOG_SIZE_LIMIT, open_text
from tendon_newton.errors import InvalidRecording

DELIMITERS = (",", ";", "\t", "|", " ")
"""What may separate cells; a space alone may stand inside one as well."""
COMMENTS = ("#", "%", "//")
"""What lines without a row begin with, the most usual first."""
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
    above: int = 0  # Lines above the header that are neither comments nor rows

    def rows(self, lines: Iterable[str]) -> Iterable[str]:
        """Return the lines without comments, a header first."""
        mark = self.comment
        kept = lines if mark is None else (x for x in lines if not x.lstrip().startswith(mark))
        kept = islice(kept, self.above, None)
        return chain([(self.delimiter or ",").join(self.header)], kept) if self.header else kept

    def guessed(self, path: Path, wanted: Collection[str]) -> "CsvDialect":
        """Return the dialect of a file, with what was not said guessed.

        The delimiter is the one with which the header has the most of the wanted columns, and of
        these the most cells. Decimals have commas where some wanted cell has one and none has a
        point; where commas separate cells as well, such a cell stands in quotes.
        """
        with open_text(path, InvalidRecording, PROMISE, size_limit=LOG_SIZE_LIMIT) as file:
            first = list(islice(file, LOOKED_AT + 1))
        try:
            seen = self if self.comment is not None else self.with_comments(first, wanted)
            lines = list(seen.rows(first))
            if lines and not self.header:
                above = max(range(len(lines)), key=lambda k: shared_names(lines[k], wanted))
                seen, lines = replace(seen, above=above), lines[above:]
            if not lines:
                return replace(seen, delimiter=seen.delimiter or ",", decimal=seen.decimal or ".")
            delimiter = seen.delimiter or guess_delimiter(lines[0], wanted)
            decimal = seen.decimal or guess_decimal(lines, delimiter, wanted)
        except csv.Error as error:
            raise InvalidRecording(f"{path}: a log must be CSV: {error}") from error
        return replace(seen, delimiter=delimiter, decimal=decimal)

    def with_comments(self, lines: list[str], wanted: Collection[str]) -> "CsvDialect":
        """Return what lines without a row begin with, and the header where it is such a line."""
        for mark in COMMENTS:
            marked = [x.strip().lstrip(mark) for x in lines if x.lstrip().startswith(mark)]
            if not marked or len(marked) == len(lines):
                continue
            plain = next(line for line in lines if not line.lstrip().startswith(mark))
            best = max(marked, key=lambda line: shared_names(line, wanted))
            if self.header or shared_names(best, wanted) <= shared_names(plain, wanted):
                return replace(self, comment=mark)
            delimiter = self.delimiter or guess_delimiter(best, wanted)
            names = tuple(cells_of(best, delimiter))
            return replace(self, comment=mark, header=names, delimiter=delimiter)
        return self

    def text(self, given: "CsvDialect") -> str:
        """Say what of this was guessed; empty where it is what any program expects."""
        words: list[str] = []
        if given.comment is None and self.comment is not None:
            words.append(f"comments after {self.comment!r}")
        if self.above:
            words.append(f"{self.above} lines above its header")
        if given.delimiter is None and self.delimiter != ",":
            words.append(f"cells separated by {self.delimiter!r}")
        if given.decimal is None and self.decimal != ".":
            words.append("decimal commas")
        return " and ".join(words)


def shared_names(line: str, wanted: Collection[str]) -> int:
    """Return how many of the wanted columns a header line has."""
    return max(len(set(cells_of(line, delimiter)) & set(wanted)) for delimiter in DELIMITERS)


def cells_of(line: str, delimiter: str) -> list[str]:
    """Return the cells of a line."""
    rows = csv.reader([line], delimiter=delimiter, skipinitialspace=True)
    return [cell.strip() for row in rows for cell in row]


def guess_delimiter(header: str, wanted: Collection[str]) -> str:
    """Return what separates the cells of a header line."""

    def score(delimiter: str) -> tuple[int, bool, int]:
        cells = set(cells_of(header, delimiter))
        return len(cells & set(wanted)), delimiter != " ", len(cells)

    return max(DELIMITERS, key=score)


def guess_decimal(lines: list[str], delimiter: str, wanted: Collection[str]) -> str:
    """Return the decimal mark of the wanted cells."""
    rows = csv.DictReader(lines, skipinitialspace=True, delimiter=delimiter)
    cells = [row[name] for row in rows for name in wanted if isinstance(row.get(name), str)]
    commas = any(COMMA.fullmatch(cell) for cell in cells)
    points = any(POINT.fullmatch(cell) for cell in cells)
    return "," if commas and not points else "."
