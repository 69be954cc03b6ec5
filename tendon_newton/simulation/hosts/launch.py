"""All worlds of a run, and how kernels are launched over them."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import warp as wp

from tendon_newton.scheduler import THREADS_VARIABLE

CHUNKS_PER_THREAD = 4
"""Launches per thread, so that a slow one does not leave the other thread idle."""


@dataclass(frozen=True, kw_only=True)
class Launch:
    """All worlds of a run, as kernels take them."""

    numbers: Any
    """Numbers of the benches, a `Mechanism` struct."""
    worlds: Any
    """What tells the worlds apart, a `Worlds` struct."""
    commands: Any
    """What their servos are asked for, a `Commands` struct."""
    states: Any
    """Where they are, a `States` struct."""
    count: int
    """Number of worlds W."""
    device: Any
    """Warp device."""

    def run(self, kernel: wp.Kernel, *arguments: Any) -> None:
        """Launch a kernel whose first arguments are the first world, numbers, worlds and commands.

        On a CPU in chunks on every core, as Warp itself uses one.
        """
        inputs = [self.numbers, self.worlds, self.commands, *arguments]
        if self.device.is_cuda:
            wp.launch(kernel, self.count, inputs=[0, *inputs], device=self.device)
            return
        threads = min(self.count, int(os.environ.get(THREADS_VARIABLE, os.cpu_count() or 1)))
        edges = np.unique(np.linspace(0, self.count, threads * CHUNKS_PER_THREAD + 1).astype(int))
        commands = [
            wp.launch(
                kernel,
                int(end - start),
                inputs=[int(start), *inputs],
                device=self.device,
                record_cmd=True,
            )
            for start, end in pairwise(edges)
        ]
        with ThreadPoolExecutor(threads) as pool:
            list(pool.map(lambda command: command.launch(), commands))
