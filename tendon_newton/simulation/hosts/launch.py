"""All worlds of a run, and how kernels are launched over them."""

from concurrent.futures import ThreadPoolExecutor, wait
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from threading import Lock
from typing import Any

import numpy as np
import warp as wp

from tendon_newton.scheduler import thread_count

# Launches per thread, so that a slow one does not leave the other thread idle
CHUNKS_PER_THREAD = 4
ONE_AT_A_TIME = Lock()  # Warp loads modules as it prepares a launch, and not in two threads at once


@dataclass(frozen=True, kw_only=True)
class Launch:
    """All worlds of a run, as kernels take them."""

    numbers: Any  # Numbers of the benches, a `Mechanism` struct
    worlds: Any  # What tells the worlds apart, a `Worlds` struct
    commands: Any  # What their servos are asked for, a `Commands` struct
    states: Any  # Where they are, a `States` struct
    count: int  # Number of worlds W
    device: Any  # Warp device

    def run(self, kernel: wp.Kernel, *arguments: Any) -> None:
        """Launch a kernel whose first arguments are the first world, numbers, worlds and commands.

        On a CPU in chunks on every core, as Warp itself uses one.
        """
        inputs = [self.numbers, self.worlds, self.commands, *arguments]
        if self.device.is_cuda:
            wp.launch(kernel, self.count, inputs=[0, *inputs], device=self.device)
            return
        threads = thread_count()
        parts = min(self.count, threads * CHUNKS_PER_THREAD)
        edges = np.linspace(0, self.count, parts + 1).astype(int)
        with ONE_AT_A_TIME:
            commands: list[Any] = [
                wp.launch(
                    kernel,
                    int(end - start),
                    inputs=[int(start), *inputs],
                    device=self.device,
                    record_cmd=True,
                )
                for start, end in pairwise(edges)
            ]
        chunks = [cores(threads).submit(command.launch) for command in commands]
        try:
            for chunk in chunks:
                chunk.result()
        finally:  # after Ctrl-C no chunk may write to arrays that are gone
            wait([chunk for chunk in chunks if not chunk.cancel()])


@cache
def cores(threads: int) -> ThreadPoolExecutor:
    """Return the threads that kernels run on, whoever launches them."""
    return ThreadPoolExecutor(threads)
