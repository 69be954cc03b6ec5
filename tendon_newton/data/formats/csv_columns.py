"""The columns of a CSV file, read block by block: a file takes about its own size in memory."""

import csv
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Set
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tendon_newton.data.files.text_file import LOG_SIZE_LIMIT, open_text
from tendon_newton.data.formats.topic_mapping import COLUMNS, MEASURED_COLUMNS
from tendon_newton.data.recording import Array
from tendon_newton.errors import InvalidRecording, listed, shown

REQUIRED_COLUMNS = ("t", *MEASURED_COLUMNS)
KNOWN_COLUMNS = ("t", *COLUMNS, "joint_angle", "joint_load")
TAKEN_IN = "are taken in by import mapped, docs/your_logs.md"
INDEX = "0|[1-9][0-9]{0,2}"
"""How the number of a tendon is written; no servo bus carries a thousand."""
KNOWN = re.compile(rf"({'|'.join(KNOWN_COLUMNS)})(_({INDEX}))?")
BLOCK_CELLS = 1 << 16  # Cells that are text at the same time
CELL_LIMIT = 1 << 25  # Cells of a file, each a float64
WORD_LIMIT = 1000
"""Longest cell of an unknown column [characters]: all rows are padded to the longest."""
WORD_BYTES = 1 << 28  # Memory of all columns of words [bytes]
WORD_OVERHEAD = 64  # Bytes of a word in memory beside its characters

Rows = list[list[str]]
Columns = dict[str, NDArray[Any]]


def read_columns(path: Path, name: str) -> Columns:
    """Read every column: numbers if all of its cells are, else words.

    Raises:
        InvalidRecording: The file is no CSV file or too large, or a known column holds words.
    """
    header, numbers, worded = read_numbers(path, name)
    columns: Columns = {cell: numbers[:, place] for place, cell in enumerate(header)}
    return columns | read_words(path, name, worded) if worded else columns


def read_numbers(path: Path, name: str) -> tuple[list[str], Array, set[int]]:
    """Return the header, all cells as numbers, (T, columns), and the places of columns of words."""
    kept: list[Array] = []
    worded: set[int] = set()
    header: list[str] = []
    row = 0
    for header, block in read_blocks(path, name):
        if (row + len(block)) * len(header) > CELL_LIMIT:
            raise InvalidRecording(
                f"{name}: a recording has at most {CELL_LIMIT} cells; it has more"
            )
        try:
            values = np.array(block, dtype=np.float64)
        except ValueError:
            values = np.column_stack(
                [
                    cells_as_numbers(header, place, cells, row, name, worded)
                    for place, cells in enumerate(zip(*block, strict=True))
                ]
            )
        kept.append(values)
        row += len(block)
    return header, np.concatenate(kept), worded


def cells_as_numbers(
    header: list[str], place: int, cells: tuple[str, ...], row: int, name: str, worded: set[int]
) -> Array:
    """Return a column's part in a block; of an unknown column with words note its place."""
    if place not in worded:
        try:
            return np.array(cells, dtype=np.float64)
        except ValueError:
            if KNOWN.fullmatch(header[place]):
                k = next(k for k, cell in enumerate(cells) if not is_number(cell))
                cell = cells[k].strip()
                came = f"is {shown(cell)}" if cell else "is empty"
                raise InvalidRecording(
                    f"{name}: {header[place]} must be a number; row {row + k} {came}"
                ) from None
            worded.add(place)
    return np.full(len(cells), np.nan)


def read_words(path: Path, name: str, places: Set[int]) -> Columns:
    """Read some columns as words; equal words are kept once."""
    words: dict[str, str] = {}
    kept: dict[int, list[str]] = {place: [] for place in places}
    size = 0
    header: list[str] = []
    for header, block in read_blocks(path, name):
        for place, column in kept.items():
            for row in block:
                word = row[place].strip()
                if word not in words:
                    words[word] = word
                    size += WORD_OVERHEAD + len(word)
                    check_word(word, header[place], name)
                column.append(words[word])
            size += 8 * len(block)
        refuse_words(size, name)
    rows = max(len(column) for column in kept.values())
    for column in kept.values():  # each row has the room of the longest, 4 bytes a character
        size += 4 * rows * max(map(len, column))
    refuse_words(size, name)
    return {header[place]: np.array(column, dtype=np.str_) for place, column in kept.items()}


def check_word(word: str, column: str, name: str) -> None:
    """Refuse a cell that is a story."""
    if len(word) > WORD_LIMIT:
        raise InvalidRecording(
            f"{name}: a cell holds a number or at most {WORD_LIMIT} characters; one of "
            f"{shown(column)} has {len(word)}"
        )


def refuse_words(size: int, name: str) -> None:
    """Refuse words that would fill the memory."""
    if size > WORD_BYTES:
        raise InvalidRecording(
            f"{name}: the words of a recording take at most {WORD_BYTES} bytes; these take more: "
            "leave columns of text out"
        )


def read_blocks(path: Path, name: str) -> Iterator[tuple[list[str], Rows]]:
    """Give the header with some rows at a time, at least once."""
    promise = "a recording is a CSV file"
    with open_text(path, InvalidRecording, promise, size_limit=LOG_SIZE_LIMIT) as file:
        lines = csv.reader(file, skipinitialspace=True)
        try:
            header = [cell.strip() for line in islice(lines, 1) for cell in line]
            if not header:
                raise InvalidRecording(
                    f"{name}: a recording needs a header line and rows; it is empty, or its first "
                    "line is"
                )
            check_header(header, name)
            yield from ((header, block) for block in blocks_of(lines, len(header), name))
        except csv.Error as error:
            raise InvalidRecording(f"{name}: not a CSV file: {error} ({path})") from error


def blocks_of(lines: Iterable[list[str]], width: int, name: str) -> Iterator[Rows]:
    """Gather lines to blocks, checking their widths; empty lines are left out."""
    block: Rows = []
    total = 0
    for number, row in enumerate(lines, start=2):
        if len(row) == width:
            block.append(row)
        elif row:
            raise InvalidRecording(
                f"{name}: every line must have {width} cells as the header has; "
                f"line {number} has {len(row)}"
            )
        if len(block) * width >= BLOCK_CELLS:
            total += len(block)
            yield block
            block = []
    if not total and not block:
        raise InvalidRecording(f"{name}: a recording needs rows below its header; it has none")
    if block:
        yield block


def check_header(header: list[str], name: str) -> None:
    """Refuse a header with doubled, empty or missing columns."""
    for cell, count in Counter(header).items():
        if count > 1 or not cell:
            fault = f"{shown(cell)} stands {count} times" if cell else "one is empty"
            raise InvalidRecording(f"{name}: column names must differ and not be empty; {fault}")
    if len(header) == 1 and re.search(r"[;\t ]", header[0]):
        raise InvalidRecording(
            f"{name}: cells must be separated by commas; line 1 has none; other logs {TAKEN_IN}"
        )
    indexed = {cell.removesuffix("_0") for cell in header if cell.removesuffix("_0") != "t"}
    require([*indexed, *header], REQUIRED_COLUMNS, name)


def require(present: Iterable[str], columns: tuple[str, ...], name: str) -> None:
    """Refuse a file that lacks one of some columns."""
    present = sorted(set(present))
    missing = [column for column in columns if column not in present]
    if missing:
        raise InvalidRecording(
            f"{name}: column {missing[0]!r} is missing; there are {listed(present)} "
            f"(known columns: {', '.join(KNOWN_COLUMNS)}); logs with other columns {TAKEN_IN}"
        )


def is_number(cell: str) -> bool:
    """Tell whether a cell reads as a number."""
    try:
        float(cell)
    except ValueError:
        return False
    return True
