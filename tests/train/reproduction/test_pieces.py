"""Pieces of a stage in processes of their own."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
import warp as wp

from tendon_newton.errors import InvalidParameter
from train.reproduction.pieces import (
    Workers,
    core_count,
    kept,
    piece_file,
    read_piece,
    result_of,
)


def squared(reproduction: str, number: int) -> list[object]:
    """Return a square, and what the process is told of threads."""
    return [number**2, reproduction, os.environ["TENDON_NEWTON_THREADS"]]


def test_processes_keep_the_order_and_the_results(tmp_path: Path) -> None:
    """Two pieces share the cores; each result is in its file and comes back in its place."""
    paths = [piece_file(tmp_path, squared, number) for number in (3, 4)]
    with Workers(2) as workers, workers.turn:
        found = workers.done(squared, "r", list(zip((3, 4), paths, strict=True)))
    threads = str(max(1, core_count() // 2))
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


def test_only_cores_that_a_process_may_use_count() -> None:
    """A list of cores that it was given (taskset) is shared, not the whole computer."""
    assert 1 <= core_count() <= (os.cpu_count() or 1)
    if hasattr(os, "sched_getaffinity"):
        assert core_count() == len(os.sched_getaffinity(0))


def test_pieces_simulate_on_the_cpu() -> None:
    """Also where Warp would take a GPU by itself; afterwards it does so again."""
    before = str(wp.get_device())
    assert result_of(default_device, None, 0) == "cpu"
    assert str(wp.get_device()) == before


def default_device(reproduction: None, item: int) -> str:
    """Return where Warp puts an array that is not told."""
    return str(wp.zeros(1, dtype=float).device)
