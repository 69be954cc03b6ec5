"""Small jobs for the tests of schedulers: a process that does one loads nothing else."""

import os
import time

from tendon_newton.errors import InvalidParameter
from tendon_newton.scheduler import THREADS_VARIABLE


def squared(number: int) -> tuple[int, str | None, int]:
    """Return a square, the threads that a simulation would take, and the process."""
    time.sleep(0.1)  # so that one process does not take all
    return number**2, os.environ.get(THREADS_VARIABLE), os.getpid()


def refuse(number: int) -> int:
    """Fail at one number."""
    if number == 2:
        raise InvalidParameter("number must not be 2")
    return number
