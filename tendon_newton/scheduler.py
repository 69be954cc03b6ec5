"""Many jobs that do not need each other: in turn, or on the cores of this machine.

A job is a function of a module and its arguments; arguments and result are pickled. Trainings,
diagnoses and climbs are such jobs: each takes a core for minutes.
"""

import os
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import Executor, Future, ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import get_context, parent_process
from threading import Thread
from typing import Any, TypeVar

from tendon_newton.errors import InvalidParameter
from tendon_newton.safe_path import safe_children

Item = TypeVar("Item")
Result = TypeVar("Result")

# Environment variable with the threads that a process's simulations take; all cores by default
THREADS_VARIABLE = "TENDON_NEWTON_THREADS"
# Environment variables with the threads of libraries; several would only wait for each other
LIBRARY_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")
MOST_JOBS = 1024


@dataclass(frozen=True, kw_only=True)
class JobOptions:
    """Where jobs are done."""

    jobs: int = 1  # Processes side by side; the cores are shared among them

    def __post_init__(self) -> None:
        """Refuse numbers of processes that no computer has."""
        if not 1 <= self.jobs <= MOST_JOBS:
            raise InvalidParameter(f"jobs must be 1 to {MOST_JOBS} processes; they are {self.jobs}")


class InTurn(Executor):
    """Does each job here when it is submitted."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Return a future that is done."""
        future: Future[Any] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:
            future.set_exception(error)
        return future


@contextmanager
def open_executor(options: JobOptions) -> Generator[Executor]:
    """Open what does the jobs; those that have not begun are dropped when the block ends.

    An interrupt ends those that run as well: what they write is whole or not there.
    """
    if options.jobs == 1:
        yield InTurn()
        return
    # a fresh interpreter each, as neither Warp's state nor CUDA's survives a fork
    with safe_children():  # they start when they are needed
        pool = ProcessPoolExecutor(
            options.jobs,
            mp_context=get_context("spawn"),
            initializer=begin_worker,
            initargs=(options.jobs,),
        )
        try:
            yield pool
        except KeyboardInterrupt:
            # each has the next job already and would begin it, whatever it makes of a signal
            for process in pool._processes.values():
                process.kill()
            raise
        finally:
            pool.shutdown(cancel_futures=True)


def completed(
    work: Callable[[Item], Result], items: Sequence[Item], options: JobOptions
) -> Iterator[tuple[Item, Result]]:
    """Yield each item with its result as the jobs end; one that fails ends all.

    The work is a function of a module.
    """
    if options == JobOptions():
        for item in items:  # one at a time, so that the first result is there before the last
            yield item, work(item)
        return
    with open_executor(options) as executor:
        futures = {executor.submit(work, item): item for item in items}
        for future in as_completed(futures):
            yield futures[future], future.result()


def begin_worker(jobs: int) -> None:
    """Take a share of the cores, and end with the program that began this process."""
    share_cores(jobs)
    Thread(target=end_with_parent, daemon=True).start()


def end_with_parent() -> None:
    """Wait for the end of what began this process; a killed program leaves no workers behind."""
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def share_cores(jobs: int) -> None:
    """Take this process's share of the cores, before it loads what asks for them."""
    os.environ[THREADS_VARIABLE] = str(max(1, core_count() // jobs))
    for name in LIBRARY_THREADS:
        os.environ[name] = "1"


def thread_count() -> int:
    """Return how many threads this process may work with."""
    return int(os.environ.get(THREADS_VARIABLE, core_count()))


def core_count() -> int:
    """Return how many cores this process may use, which are not always all of the computer."""
    own = getattr(os, "sched_getaffinity", None)
    return len(own(0)) if own else os.cpu_count() or 1
