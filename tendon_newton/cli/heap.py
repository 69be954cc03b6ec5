"""What keeps a verb small that takes minutes: one heap for all threads."""

import ctypes
import sys

HEAPS, MAPPED = -8, -3
"""Numbers of what glibc's ``mallopt`` sets: ``M_ARENA_MAX`` and ``M_MMAP_THRESHOLD``."""
LARGE = 1 << 20
"""Size of an array [B] from which on it stands alone, and is given back once it is gone."""


def share_heap() -> None:
    """Let all threads take memory from one heap, and give back what large arrays took.

    Each has its own heap else, and keeps what it took. Other C libraries than glibc are left as
    they are.
    """
    if sys.platform == "linux" and hasattr(library := ctypes.CDLL(None), "mallopt"):
        library.mallopt(HEAPS, 1)
        library.mallopt(MAPPED, LARGE)
