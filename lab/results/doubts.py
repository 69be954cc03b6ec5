"""What is wrong with where a record says that its figures come from."""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from lab.results.record import Record, combined
from lab.studies.comparison.table import rests_on

SHORT = 8  # Digits of a commit that are told
Rows = Callable[[str], tuple[str, ...]]  # A row -> files and folders that it rests on
CELLS: Mapping[str, Rows] = {"comparison": rests_on}
"""Records whose cells have their own origin, and the code that a row of such a table rests on."""


def doubts(record: Record) -> Iterator[str]:
    """Say what a record's origin is and is not.

    A cell is of other code than the record's where its fingerprint is another: the commit that it
    names may differ in what the cell does not rest on.
    """
    figures = record.figures
    stated = figures.get("commit") if record.data and isinstance(figures, dict) else None
    clean = None if stated is None else "-dirty" not in stated
    if record.clean is not clean:
        yield f"clean is {record.clean}; its file says {clean} ({stated or 'no commit'})"
    if stated is not None and not stated.startswith(record.commit):
        yield f"its commit is {record.commit}; its file says {stated}"
    if record.name in CELLS:
        yield from doubtful_cells(record, CELLS[record.name])


def doubtful_cells(record: Record, code_of: Rows) -> Iterator[str]:
    """Say which cells are of a changed tree, and whether those of other code are told."""
    for place, row, cell in cells_of(record.figures):
        if not cell.get("clean", True):
            yield f"{place}, {row}: made in a tree that git saw changed at {cell['commit']}"
    if (older := older_cells(record, code_of)) != record.older:
        yield f"cells of other code: {record.older} are told; there are {dict(older)}"


def older_cells(record: Record, code_of: Rows) -> Counter[str]:
    """Count the cells of other code than the record's, by their commits."""
    older: Counter[str] = Counter()
    for _, row, cell in cells_of(record.figures):
        wanted = combined({name: record.code[name] for name in code_of(row)})
        if cell.get("code") != wanted:
            older[str(cell["commit"])[:SHORT]] += 1
    return older


def cells_of(figures: Any) -> Iterator[tuple[str, str, dict[str, Any]]]:
    """Yield the cells of a table with their places and rows."""
    for place, rows in figures.items():
        for row, cell in rows.items():
            yield place, row, cell
