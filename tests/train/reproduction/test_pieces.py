"""Pieces of a stage in processes of their own."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from tendon_newton.errors import InvalidParameter
from train.reproduction.pieces import Workers, kept, piece_file, read_piece


def squared(reproduction: str, number: int) -> list[object]:
    """Return a square, and what the process is told of threads."""
    return [number**2, reproduction, os.environ["TENDON_NEWTON_THREADS"]]


def test_processes_keep_the_order_and_the_results(tmp_path: Path) -> None:
    """Two pieces share the cores; each result is in its file and comes back in its place."""
    paths = [piece_file(tmp_path, squared, number) for number in (3, 4)]
    with Workers(2) as workers, workers.turn:
        found = workers.done(squared, "r", list(zip((3, 4), paths, strict=True)))
    threads = str(max(1, (os.cpu_count() or 1) // 2))
    assert found == [[9, "r", threads], [16, "r", threads]]
    assert [read_piece(path) for path in paths] == found


def test_a_result_is_as_its_file_has_it(tmp_path: Path) -> None:
    """A tuple comes back as a list whether or not it was kept, so that a repeat is the same."""
    assert kept((1, 2.5), None) == [1, 2.5]
    assert kept((1, 2.5), tmp_path / "piece.json") == read_piece(tmp_path / "piece.json")


def test_there_is_at_least_one_process() -> None:
    """The message says how many there may be."""
    with pytest.raises(InvalidParameter, match="1 to 1024 processes"):
        Workers(0)
