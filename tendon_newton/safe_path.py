"""Keep the current folder out of what Python processes import: a stranger's files may lie there."""

import os
import sys
from collections.abc import Generator
from contextlib import contextmanager

SAFE_PATH = "PYTHONSAFEPATH"


def python_command(*words: str) -> list[str]:
    """Return the command that starts this interpreter, without the current folder on its path."""
    return [sys.executable, "-P", *words]


@contextmanager
def safe_children() -> Generator[None]:
    """Let interpreters that others start meanwhile leave out their current or program's folder.

    Pools of processes and libraries build such commands themselves.
    """
    before = os.environ.get(SAFE_PATH)
    os.environ[SAFE_PATH] = "1"
    try:
        yield
    finally:
        if before is None:
            del os.environ[SAFE_PATH]
        else:
            os.environ[SAFE_PATH] = before
