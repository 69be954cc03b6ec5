"""How long work takes, and what belongs beside such figures."""

from __future__ import annotations

import gc
import os
import platform
import subprocess
import sys
import time
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import torch
import warp as wp

RESULTS = Path(__file__).parent / "results"
SPANS = 7
SPAN = 0.2  # s
WARM_UPS = 5

Row = dict[str, Any]


def best_time(work: Callable[[], Any], device: Any) -> float:
    """Return the seconds of one run, the best of some spans, warm.

    By the clock on CUDA; on a CPU in the time that the process itself computed.
    """
    clock = time.perf_counter if device.is_cuda else time.process_time
    for _ in range(WARM_UPS):
        work()
    wp.synchronize_device(device)
    start = clock()
    work()
    wp.synchronize_device(device)
    count = max(1, int(SPAN / max(clock() - start, 1.0e-6)))
    best = np.inf
    for _ in range(SPANS):
        start = clock()
        for _ in range(count):
            work()
        wp.synchronize_device(device)
        best = min(best, (clock() - start) / count)
    return float(best)


def memory_in_use() -> int:
    """Return the bytes of the GPU that are taken; 0 on a CPU."""
    gc.collect()
    if not wp.get_device().is_cuda:
        return 0
    torch.cuda.empty_cache()
    wp.synchronize()
    free, total = torch.cuda.mem_get_info()
    return total - free


def say(row: Row) -> None:
    """Print a row as soon as it is there."""
    values = (f"{k} {v:.4g}" if isinstance(v, float) else f"{k} {v}" for k, v in row.items())
    sys.stdout.write(", ".join(values) + "\n")
    sys.stdout.flush()


def commit(folder: Path = Path()) -> str:
    """Return the commit of a checkout, marked where its working tree differs from it.

    A copy without its history is told the commit by the variable ``BENCHMARK_COMMIT``.
    """
    told = os.environ.get("BENCHMARK_COMMIT")
    if told:
        return told
    command = ["git", "describe", "--always", "--dirty", "--abbrev=12"]
    return subprocess.run(
        command, cwd=folder, capture_output=True, text=True, check=False
    ).stdout.strip()


def circumstances(command: str) -> dict[str, str]:
    """Return what belongs beside figures: what was run, on what, and when."""
    device = wp.get_device()
    return {
        "command": command,
        "commit": commit(),
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "device": device.name if device.is_cuda else f"{platform.machine()}, one core",
        "torch": torch.__version__,
    }
