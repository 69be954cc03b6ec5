"""Steps of Warp's kernels without Python's share between them."""

from collections.abc import Callable
from typing import Any

import warp as wp


def replayed(step: Callable[[], None]) -> Callable[[], None]:
    """Return a step that Python launches once; from then on a graph on the CPU does the same.

    Args:
        step: What launches kernels, on the same arrays every time, and reads nothing back.
    """
    graphs: list[Any] = []

    def again() -> None:
        if graphs:
            wp.capture_launch(graphs[0])
            return
        step()  # compiles and allocates before the capture
        with wp.ScopedCapture(device="cpu") as capture:
            step()  # recorded, not done
        graphs.append(capture.graph)

    return again
