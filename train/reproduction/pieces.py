"""The pieces that a stage consists of: done here, or side by side by several processes, and kept.

A piece is a function of a reproduction and one item. Its result is what JSON can hold, and stays in
a file, so that a stage that was interrupted goes on with its next piece.
"""

from __future__ import annotations

import hashlib
import json
import os
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import AbstractContextManager
from multiprocessing import get_context
from pathlib import Path
from types import TracebackType
from typing import Any

from tendon_newton.data.files.json_file import read_json
from tendon_newton.errors import InvalidOutput, InvalidParameter

THREADS_VARIABLES = ("TENDON_NEWTON_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")
"""Environment variables with a process's number of threads: the simulator's, and the libraries'."""

Work = Callable[[Any, Any], Any]
"""(reproduction, item) -> what JSON can hold; a module's function, so that a process finds it."""


class Workers(AbstractContextManager["Workers"]):
    """Processes that do pieces, and the turn of the stages that wait for them.

    A fresh interpreter each, as Warp's state must not be forked.

    Args:
        count: Processes.
    """

    def __init__(self, count: int) -> None:
        if not 1 <= count <= 1024:
            raise InvalidParameter(f"jobs must be 1 to 1024 processes; they are {count}")
        self.count = count
        self.turn = threading.Lock()
        """Held by the one stage that computes in this process; a stage that waits for its pieces
        gives it away."""
        self._pool: ProcessPoolExecutor | None = None

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Let the processes end."""
        if self._pool is not None:
            self._pool.shutdown(cancel_futures=True)

    def done(
        self, work: Work, reproduction: Any, pieces: Sequence[tuple[Any, Path | None]]
    ) -> list[Any]:
        """Return what a function makes of some items; meanwhile another stage has its turn.

        Args:
            work: The function.
            reproduction: Its first argument.
            pieces: Items, and where each result is kept.
        """
        if self._pool is None:
            self._pool = ProcessPoolExecutor(
                self.count, mp_context=get_context("spawn"), initializer=begin_quietly
            )
        threads = max(1, core_count() // max(1, min(self.count, len(pieces))))
        futures = [
            self._pool.submit(done_alone, work, reproduction, item, path, threads)
            for item, path in pieces
        ]
        self.turn.release()
        try:
            return [future.result() for future in futures]
        finally:
            for future in futures:
                future.cancel()
            self.turn.acquire()


def core_count() -> int:
    """Return how many cores this process may use, which are not always all of the computer."""
    own = getattr(os, "sched_getaffinity", None)
    return len(own(0)) if own else os.cpu_count() or 1


def begin_quietly() -> None:
    """Prepare a process before it loads anything: libraries stay on one core, Warp says nothing."""
    for name in THREADS_VARIABLES:
        os.environ[name] = "1"
    from tendon_newton.device_code.quiet import quiet_warp

    quiet_warp()


def done_alone(work: Work, reproduction: Any, item: Any, path: Path | None, threads: int) -> Any:
    """Do a piece in a process of its own."""
    os.environ[THREADS_VARIABLES[0]] = str(threads)
    return kept(result_of(work, reproduction, item), path)


def result_of(work: Work, reproduction: Any, item: Any) -> Any:
    """Return what a function makes of an item, its simulations on the CPU.

    Fits and replays have few worlds and many steps that follow each other, where a GPU is slower
    than a core; what needs a GPU asks for it.
    """
    import warp as wp

    with wp.ScopedDevice("cpu"):
        return work(reproduction, item)


def piece_file(folder: Path, work: Work, item: Any) -> Path:
    """Return where the result of a piece is kept."""
    words = json.dumps([work.__name__, item], sort_keys=True)
    return folder / f"{work.__name__}_{hashlib.sha256(words.encode()).hexdigest()[:16]}.json"


def kept(result: Any, path: Path | None) -> Any:
    """Write a piece's result, whole or not at all, and return it as a file has it."""
    text = json.dumps({"result": result}) + "\n"
    if path is None:
        return json.loads(text)["result"]
    beside = path.with_name(f".{path.name}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        beside.write_text(text, encoding="utf-8")
        beside.replace(path)
    except OSError as error:
        raise InvalidOutput(f"{path}: {error.strerror or error}") from error
    return json.loads(text)["result"]


def read_piece(path: Path) -> Any:
    """Return a piece's result that an earlier run kept."""
    return read_json(path, InvalidOutput, "a piece of a stage is a JSON file")["result"]
