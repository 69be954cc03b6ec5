"""Spoil a sound file at random: its bytes, its lines, its cells and its values."""

import os
from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Any

OUTSIDE = "../outside/secret.txt"
"""A file that no reader may open, seen from the folder of a spoilt file."""
HOSTILE_TEXT = (
    "", " ", "nan", "-inf", "1e999", "-0", "1_0", "0x10", "١٢", "1,5", "\ufeff", "\0", "\x1b[31m",
    "\r", "\n", '"', "'", ";", "\t", "#", "[", "]]", "{", "= 3", "𝟙", "\u202e", "\ud7ff", "é" * 200,
    "9" * 5000, "x" * 200_000, "[" * 3000, '{"a":' * 3000, "a." * 3000, "../..", OUTSIDE,
    "/etc/passwd", "theta", "$\\frac{x$", "-1", "1e300", "99999999999",
)  # fmt: skip
HOSTILE_BYTES = (b"\0", b"\xff\xfe", b"\x80", b"\xed\xa0\x80", b"\r\n", b"\xef\xbb\xbf", b"\x1a")
HOSTILE_VALUES: tuple[Any, ...] = (
    True, 0, -1, 3, 10**400, -(10**30), 0.0, -1e308, 1e308, "", "train", "x" * 100_000, "\x1b[0m",
    "nan", "../x", OUTSIDE, "a\nb", [], [1, "a"], ["deg"], [[]], {}, {"a": {"a": 1}}, {"": 0},
    {"mass": 1}, float("nan"), float("inf"), float("-inf"), None,
)  # fmt: skip
HOSTILE_NAMES = ("", "mass", "split", "naem", "x" * 100_000, "\x1b[31m", "ключ")

Change = Callable[[bytes, Random], bytes]


def flip(content: bytes, rng: Random) -> bytes:
    """Change, remove, insert, double or cut bytes at random places, up to 64 times."""
    broken = bytearray(content)
    for _ in range(rng.choice((1, 1, 2, 8, 64))):
        kind, place = rng.randrange(5), rng.randrange(len(broken) + 1)
        if kind == 0 and broken:
            broken[min(place, len(broken) - 1)] = rng.randrange(256)
        elif kind == 1:
            del broken[place : place + rng.randrange(1, 50)]
        elif kind == 2:
            broken[place:place] = rng.randbytes(rng.randrange(1, 20))
        elif kind == 3:
            broken[place:place] = broken[max(0, place - 30) : place]
        elif rng.random() < 0.2:
            del broken[max(place, 1) :]
    return bytes(broken)


def change_lines(content: bytes, rng: Random) -> bytes:
    """Change text or lines, without knowledge of the format."""
    kind = rng.choice(("cut", "insert", "bytes", "drop", "double", "swap", "crlf", "cr"))
    at = rng.randrange(len(content) + 1)
    lines = content.split(b"\n")
    line, second = rng.randrange(len(lines)), rng.randrange(len(lines))
    if kind == "cut":
        return content[:at]
    if kind in ("insert", "bytes"):
        text = rng.choice(HOSTILE_TEXT).encode()
        junk = text if kind == "insert" else rng.choice(HOSTILE_BYTES)
        return content[:at] + junk + content[at:]
    if kind == "drop":
        del lines[line]
    elif kind == "double":
        lines.insert(second, lines[line])
    elif kind == "swap":
        lines[line], lines[second] = lines[second], lines[line]
    return {"crlf": b"\r\n", "cr": b"\r"}.get(kind, b"\n").join(lines)


def change_cells(content: bytes, rng: Random) -> bytes:
    """Change one cell of a CSV file, often of its header, or a whole column."""
    kind = rng.choice(("cell", "header", "drop", "double"))
    rows = [line.split(b",") for line in content.split(b"\n")]
    column, value = rng.randrange(100), rng.choice(HOSTILE_TEXT).encode()
    chosen = rows[:1] if kind == "header" else [rng.choice(rows)]
    for cells in chosen if kind in ("cell", "header") else rows:
        if not cells:
            continue
        at = column % len(cells)
        if kind == "drop":
            del cells[at]
        else:
            cells[at : at + (kind != "double")] = [cells[at] if kind == "double" else value]
    return b"\n".join(b",".join(cells) for cells in rows)


def change_table(table: Any, rng: Random) -> Any:
    """Return a nested table with one key or value changed, dropped, renamed or doubled."""
    kind = rng.choice(("value", "value", "drop", "rename", "double"))
    if not isinstance(table, dict | list) or not table:
        return rng.choice(HOSTILE_VALUES)
    keys = list(table) if isinstance(table, dict) else list(range(len(table)))
    key = rng.choice(keys)
    if isinstance(table[key], dict | list) and rng.random() < 0.7:
        changed = change_table(table[key], rng)
    elif kind == "drop":
        return without(table, key)
    elif kind == "double" and isinstance(table, list):
        return [*table, table[key]]
    elif kind == "rename" and isinstance(table, dict):
        return {(rng.choice(HOSTILE_NAMES) if k == key else k): v for k, v in table.items()}
    else:
        changed = rng.choice(HOSTILE_VALUES)
    if isinstance(table, list):
        return [changed if k == key else value for k, value in enumerate(table)]
    return table | {key: changed}


def without(table: Any, key: Any) -> Any:
    """Return a table or list without one entry."""
    if isinstance(table, list):
        return [value for k, value in enumerate(table) if k != key]
    return {k: value for k, value in table.items() if k != key}


def table_changer(table: Any, dump: Callable[[Any], str]) -> Change:
    """Return a change of the values of a table, which is then written; of its text at times."""

    def change(content: bytes, rng: Random) -> bytes:
        spoilt = table
        for _ in range(rng.randrange(3)):
            spoilt = change_table(spoilt, rng)
            try:
                content = dump(spoilt).encode("utf-8", "surrogatepass")
            except (TypeError, ValueError, AttributeError):  # a TOML file is a table of text keys
                break
        return change_lines(content, rng) if rng.random() < 0.4 else content

    return change


def either(*changes: Change) -> Change:
    """Return a change that is one to three of these."""

    def change(content: bytes, rng: Random) -> bytes:
        for _ in range(rng.randrange(1, 4)):
            content = rng.choice(changes)(content, rng)
        return content

    return change


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
