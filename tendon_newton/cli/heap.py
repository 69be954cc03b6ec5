"""Memory of a verb: one heap for all threads, and nothing looked for while packages load."""

from __future__ import annotations

import ctypes
import gc
import sys
from collections.abc import Generator
from contextlib import contextmanager

ARENAS = -8
"""Number of the limit on heaps among those that glibc's ``mallopt`` sets, ``M_ARENA_MAX``."""


def share_heap() -> None:
    """Let all threads take memory from one heap; each has its own else, and keeps what it took.

    Other C libraries than glibc are left as they are.
    """
    if sys.platform == "linux" and hasattr(library := ctypes.CDLL(None), "mallopt"):
        library.mallopt(ARENAS, 1)


@contextmanager
def loading() -> Generator[None]:
    """Load packages without looking for dead objects: all that they make lives on."""
    gc.disable()
    try:
        yield
    finally:
        gc.enable()
