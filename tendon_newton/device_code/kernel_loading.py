"""Kernels made ready before they are launched: compiled on all cores, and told."""

import json
import logging
import os
import shutil
import time
from collections import deque
from collections.abc import Generator, Iterable
from concurrent.futures import ThreadPoolExecutor, wait
from contextlib import contextmanager, suppress
from errno import EACCES
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import Lock
from typing import Any

import warp as wp

from tendon_newton.data.files.text_file import write_text
from tendon_newton.errors import InvalidOutput
from tendon_newton.scheduler import thread_count

LOG = logging.getLogger(__name__)
# Kernels that a wheel brings, as Warp's cache has them; see `tests.wheel`
BROUGHT = Path(__file__).parents[1] / "_kernels"
# File in Warp's cache: how long each kind of kernel took when it was compiled last [s]
TIMES = "tendon_newton_compile_seconds.json"


@contextmanager
def written_cache() -> Generator[None]:
    """Say what to do where compiled kernels cannot be kept.

    Raises:
        InvalidOutput: The folder for them cannot be written.
    """
    try:
        yield
    except OSError as error:
        raise InvalidOutput(
            f"{error.filename or kernel_cache()}: compiled kernels must be kept on this computer, "
            f"and cannot be: {error.strerror or error}; set WARP_CACHE_PATH to a folder that can "
            "be written"
        ) from error


@written_cache()
def load_kernels(kernels: Iterable[wp.Kernel], device: Any) -> None:
    """Compile kernels that no run on this computer compiled before, on all cores.

    A wheel brings those of some diagnoses. Otherwise a kernel compiles when it is first launched,
    one after the other. What compiles, how long that took last time, and each that is done are
    logged.

    What takes longest to compile should stand first.
    """
    device = wp.get_device(device)
    kernel_cache().mkdir(parents=True, exist_ok=True)
    missing = {kernel.module: kind_of(kernel) for kernel in kernels if not is_kept(kernel, device)}
    if not missing:
        return
    if not os.access(kernel_cache(), os.W_OK):
        raise OSError(EACCES, os.strerror(EACCES), kernel_cache())
    jobs, workers = iter(missing.items()), min(len(missing), thread_count())
    LOG.info(announcement(list(missing.values()), workers))
    begin, times, done, telling = time.monotonic(), last_times(), [], Lock()

    def compile_next() -> None:
        """Compile what is next until nothing is left: all threads take from the same jobs."""
        for module, kind in jobs:
            times[kind] = round(seconds_to_load(module, device), 1)
            with telling:
                done.append(module)
                elapsed = time.monotonic() - begin
                LOG.info(f"compiled {len(done)} of {len(missing)} kernels in {elapsed:.0f} s")

    others = [compilers().submit(compile_next) for _ in range(workers - 1)]
    try:
        compile_next()
    finally:  # after Ctrl-C no further kernel is begun
        deque(jobs, maxlen=0)
        wait(others)
    for other in others:
        other.result()
    write_text(kernel_cache() / TIMES, json.dumps(times))


@cache
def compilers() -> ThreadPoolExecutor:
    """Return threads that go on to live: each compiles Warp's header once, for 1.3 s."""
    return ThreadPoolExecutor()


def is_kept(kernel: wp.Kernel, device: Any) -> bool:
    """Tell whether Warp's cache has a kernel; one that came with the program is put there."""
    block = kernel.module.options["block_dim"] if device.is_cuda else 1
    name = kernel.module.get_module_identifier(block)
    kept, brought = kernel_cache() / name, BROUGHT / name
    if brought.is_dir() and not kept.is_dir():
        with TemporaryDirectory(dir=kernel_cache()) as folder:
            whole = shutil.copytree(brought, Path(folder) / name)
            with suppress(OSError):  # another process was faster
                whole.rename(kept)
    return kept.is_dir()


def seconds_to_load(module: Any, device: Any) -> float:
    """Compile a module and return how long that took [s]."""
    begin = time.monotonic()
    wp.force_load(device, [module], max_workers=0)
    return time.monotonic() - begin


def kind_of(kernel: wp.Kernel) -> str:
    """Return a kernel's name without what tells apart those of several mechanisms."""
    return kernel.key.rpartition("_kernel")[0]


def announcement(kinds: list[str], workers: int) -> str:
    """Say what compiles, and how long that took last time if it ever did."""
    counted = ", ".join(f"{kinds.count(kind)} x {kind}" for kind in dict.fromkeys(kinds))
    text = f"compiling {len(kinds)} kernels ({counted}) on {workers} cores, once on this computer"
    times = last_times()
    known = [times[kind] for kind in kinds if kind in times]
    if len(known) < len(kinds):
        return text
    return f"{text}; the last such took {max(max(known), sum(known) / workers):.0f} s"


def last_times() -> dict[str, float]:
    """Return how long each kind of kernel took last time [s]."""
    try:
        return json.loads((kernel_cache() / TIMES).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}


def kernel_cache() -> Path:
    """Return the folder in which Warp keeps what it compiled."""
    return Path(str(wp.config.kernel_cache_dir))
