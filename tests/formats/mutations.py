"""What a fuzzer does to a sound file: to its bytes, its lines, its cells and its values."""

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hypothesis import strategies as st

HOSTILE_TEXT = (
    "", " ", "nan", "-inf", "1e999", "-0", "1_0", "0x10", "١٢", "1,5", "\ufeff", "\0", "\x1b[31m",
    "\r", "\n", '"', "'", ";", "\t", "#", "[", "]]", "{", "= 3", "𝟙", "\u202e", "\ud7ff", "é" * 200,
    "9" * 5000, "x" * 200_000, "[" * 3000, '{"a":' * 3000, "../..", "/etc/passwd", "theta",
)  # fmt: skip
HOSTILE_BYTES = (b"\0", b"\xff\xfe", b"\x80", b"\xed\xa0\x80", b"\r\n", b"\xef\xbb\xbf", b"\x1a")
HOSTILE_VALUES: tuple[Any, ...] = (
    True, 0, -1, 3, 10**400, -(10**30), 0.0, -1e308, 1e308, "", "train", "x" * 100_000, "\x1b[0m",
    "nan", "../x", "a\nb", [], [1, "a"], [[]], {}, {"a": {"a": 1}}, {"": 0}, {"mass": 1},
)  # fmt: skip
FLOATS_THAT_ARE_NONE = (float("nan"), float("inf"), float("-inf"))

Change = Callable[[bytes], bytes]

places = st.integers(0, 10_000)


@st.composite
def byte_changes(draw: st.DrawFn) -> Change:
    """A change of bytes or lines that knows nothing of the format."""
    kind = draw(st.sampled_from(("cut", "insert", "bytes", "drop", "double", "swap", "crlf", "cr")))
    place, other = draw(places), draw(places)
    text = draw(st.sampled_from(HOSTILE_TEXT)).encode()
    junk = draw(st.sampled_from(HOSTILE_BYTES))

    def change(content: bytes) -> bytes:
        at = place % (len(content) + 1)
        lines = content.split(b"\n")
        line, second = place % len(lines), other % len(lines)
        if kind == "cut":
            return content[:at]
        if kind in ("insert", "bytes"):
            return content[:at] + (text if kind == "insert" else junk) + content[at:]
        if kind == "drop":
            del lines[line]
        elif kind == "double":
            lines.insert(second, lines[line])
        elif kind == "swap":
            lines[line], lines[second] = lines[second], lines[line]
        return {"crlf": b"\r\n", "cr": b"\r"}.get(kind, b"\n").join(lines)

    return change


@st.composite
def cell_changes(draw: st.DrawFn) -> Change:
    """A change of one cell of a CSV file, often of its header, or of a whole column."""
    kind = draw(st.sampled_from(("cell", "header", "drop", "double")))
    row, column = draw(places), draw(places)
    value = draw(st.sampled_from(HOSTILE_TEXT)).encode()

    def change(content: bytes) -> bytes:
        rows = [line.split(b",") for line in content.split(b"\n")]
        chosen = rows[:1] if kind == "header" else [rows[row % len(rows)]]
        for cells in chosen if kind in ("cell", "header") else rows:
            at = column % len(cells)
            if kind == "drop":
                del cells[at]
            else:
                cells[at : at + (kind != "double")] = [cells[at] if kind == "double" else value]
        return b"\n".join(b",".join(cells) for cells in rows)

    return change


@dataclass(frozen=True, kw_only=True)
class TableChange:
    """A change of one key or value of a nested table."""

    kind: str
    path: tuple[int, ...]
    value: Any
    name: str

    def __call__(self, table: Any) -> Any:
        """Return the table with the change, as far as its path leads."""
        if not self.path or not isinstance(table, dict | list) or not table:
            return self.value
        rest = TableChange(kind=self.kind, path=self.path[1:], value=self.value, name=self.name)
        keys = list(table) if isinstance(table, dict) else list(range(len(table)))
        key = keys[self.path[0] % len(keys)]
        deeper = isinstance(table[key], dict | list) and self.path[1:]
        if isinstance(table, list):
            if self.kind == "double":
                return [*table, table[key]]
            if self.kind == "drop" and not deeper:
                return [row for i, row in enumerate(table) if i != key]
            return [rest(row) if i == key else row for i, row in enumerate(table)]
        if self.kind == "rename" and not deeper:
            return {(self.name if k == key else k): v for k, v in table.items()}
        if self.kind == "drop" and not deeper:
            return {k: v for k, v in table.items() if k != key}
        return {k: rest(v) if k == key else v for k, v in table.items()}


def table_changes(*, floats: tuple[float, ...] = FLOATS_THAT_ARE_NONE) -> st.SearchStrategy[Any]:
    """Changes of one key or value of a nested table.

    Args:
        floats: Floats that the format can write and that are no numbers.
    """
    return st.builds(
        TableChange,
        kind=st.sampled_from(("value", "drop", "rename", "double")),
        path=st.lists(st.integers(0, 20), min_size=1, max_size=5).map(tuple),
        value=st.sampled_from((*HOSTILE_VALUES, *floats)),
        name=st.sampled_from(("", "mass", "split", "naem", "x" * 100_000, "\x1b[31m", "ключ")),
    )


def replace_file(path: Path, kind: str) -> None:
    """Put something else in a file's place."""
    path.unlink()
    if kind == "folder":
        path.mkdir()
    elif kind == "loop":
        path.symlink_to(path.name)
    elif kind == "pipe":
        os.mkfifo(path)
    elif kind == "empty":
        path.touch()
    elif kind == "unreadable":
        path.symlink_to("/proc/self/mem")


REPLACEMENTS = ("nothing", "folder", "loop", "pipe", "empty", "unreadable")
