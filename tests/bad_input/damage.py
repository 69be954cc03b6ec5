"""Ways to spoil a sound folder of files, and the one line that must come of it."""

from collections.abc import Callable
from pathlib import Path

import pytest

from tendon_newton.cli import main

Damage = Callable[[Path], None]


def refusal(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> str:
    """Run the command line, require the exit code of misuse, and return the one error line."""
    assert main(arguments) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("error: ")
    assert "Traceback" not in line
    return line


def text(name: str, content: str) -> Damage:
    """Replace a file by this text."""
    return junk(name, content.encode())


def junk(name: str, content: bytes) -> Damage:
    """Replace a file by these bytes."""

    def damage(folder: Path) -> None:
        (folder / name).write_bytes(content)

    return damage


def swap(name: str, old: str, new: str) -> Damage:
    """Replace the first occurrence of a text in a file."""

    def damage(folder: Path) -> None:
        content = (folder / name).read_text()
        assert old in content
        (folder / name).write_text(content.replace(old, new, 1))

    return damage


def cell(row: int, column: int, value: str) -> Damage:
    """Replace one cell of the train recording."""

    def damage(folder: Path) -> None:
        lines = (folder / "train.csv").read_text().splitlines()
        cells = lines[row + 1].split(",")
        cells[column] = value
        lines[row + 1] = ",".join(cells)
        (folder / "train.csv").write_text("\n".join(lines))

    return damage


def replaced(name: str, put: Callable[[Path], None]) -> Damage:
    """Put something else in a file's place."""

    def damage(folder: Path) -> None:
        (folder / name).unlink()
        put(folder / name)

    return damage
