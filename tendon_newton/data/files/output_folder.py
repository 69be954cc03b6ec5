"""Folders for results: made, and held by one program while it writes there."""

import fcntl
import os
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

from tendon_newton.errors import InvalidOutput

HELD: dict[str, int] = {}
"""Folders that this program holds -> descriptors whose locks end with it, however it ends."""


def make_folder(
    path: Path, *read: Path | None, shared: bool = False, dataset: bool = False
) -> Path:
    """Make a folder for results, parents included, and hold it until the end of `releasing`.

    Args:
        read: Files and folders that are read, whose files results of the same names would replace.
        shared: Whether others may write there too, each to files of its own.
        dataset: Whether recordings may lie there already.

    Raises:
        InvalidOutput: Something is read from there or in the way, it may not be made, or another
            program holds it.
    """
    for source in (source for source in read if source is not None):
        home = source if source.is_dir() else source.parent
        if source.exists() and os.path.realpath(path) == os.path.realpath(home):
            raise InvalidOutput(
                f"{path}: results need a folder of their own; {source} is read from this one, and "
                "results would replace its files: name another with --out"
            )
    if not dataset and (path / "dataset.toml").is_file():
        raise InvalidOutput(
            f"{path}: results need a folder of their own; this one is a dataset, and they would "
            "replace its files: name another with --out"
        )
    try:
        path.mkdir(parents=True, exist_ok=True)
        place = os.path.realpath(path)
        if not shared and place not in HELD:
            hold(place)
    except BlockingIOError as error:
        raise InvalidOutput(
            f"{path}: another program is writing its results there; wait for its end, or give "
            "another folder"
        ) from error
    except OSError as error:
        reason = "it is a file" if path.is_file() else error.strerror or error
        raise InvalidOutput(f"{path}: results need a folder; {reason}") from error
    if not os.access(path, os.W_OK):
        raise InvalidOutput(f"{path}: results need a folder; nothing may be written to this one")
    return path


def hold(place: str) -> None:
    """Lock a folder; where its file system has no locks, do without."""
    file = os.open(place, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(file)
        raise
    except OSError:
        os.close(file)
    else:
        HELD[place] = file


@contextmanager
def releasing() -> Generator[None]:
    """Let others write into the folders that were made meanwhile, once the work is done."""
    before = set(HELD)
    try:
        yield
    finally:
        for place in set(HELD) - before:
            os.close(HELD.pop(place))
