"""Progress in a notebook: one line below the cell, written anew."""

import sys
import time
from collections.abc import Callable
from typing import Any

from tendon_newton.diagnosis.time_left import time_left

Progress = Callable[[str], None]


def notebook_progress() -> Progress:
    """Return what tells a notebook's reader what is being done; elsewhere nobody is told."""
    ipython: Any = sys.modules.get("IPython")
    if ipython is None or not hasattr(ipython.get_ipython(), "kernel"):  # no page, or a terminal
        return lambda _: None
    handle = ipython.display.display("starting ...", display_id=True)
    start = time.monotonic()

    def tell(text: str) -> None:
        elapsed = time.monotonic() - start
        handle.update(f"{elapsed:.0f} s  {text}{time_left(text, elapsed) or ''}")

    return tell
