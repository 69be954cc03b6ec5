"""Work on a stranger's file in a process of its own, with bounds on memory and time.

A model file is a list of operations: a few hundred bytes can ask for gigabytes or for ever. Work
that would take the machine down ends a child process here, and the parent says so in one line.
"""

import contextlib
import importlib
import os
import pickle
import re
import resource
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from tendon_newton.errors import TendonNewtonError
from tendon_newton.safe_path import python_command

MEMORY = 1 << 30  # Bytes that the work may allocate beyond the modules that it needs
SECONDS = 3
"""Time of a core that the work may take [s]; a model that we use loads in a tenth of one."""
PATIENCE = 60.0
"""Time by the clock that the child may take in all [s], on a computer that is busy with others."""
LENGTH = 300  # Most that is repeated of what a library says [characters]
START = f"import sys; sys.path[:] = {{path!r}}; from {__name__} import serve; serve()"


class TooMuch(Exception):
    """The work did not end within its bounds; the message says which."""


def guarded(
    work: Callable[..., Any], *arguments: Any, memory: int = MEMORY, seconds: int = SECONDS
) -> Any:
    """Return what a function of some module gives, called in a child process.

    Args:
        work: A function that a module holds by its name.
        *arguments: What it is called with; like its result they are pickled.
        memory: Bytes that it may allocate.
        seconds: Time of a core that it may take [s].

    Raises:
        TooMuch: The function takes more, or its process died.
        TendonNewtonError: The function raised this error.
    """
    order = pickle.dumps((work.__module__, work.__qualname__, arguments, memory, seconds))
    with tempfile.TemporaryDirectory() as empty:  # relative names in the file lead nowhere
        try:
            child = subprocess.run(
                python_command("-c", START.format(path=[*map(os.path.abspath, sys.path)])),
                input=order,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                cwd=empty,
                env=os.environ | {"OMP_NUM_THREADS": "1", "TMPDIR": empty},
                timeout=PATIENCE + seconds,
            )
        except subprocess.TimeoutExpired as error:
            raise TooMuch(f"takes more than {PATIENCE:g} s") from error
    if child.returncode in (-signal.SIGXCPU, -signal.SIGKILL):
        raise TooMuch(f"takes more than {seconds} s of a core")
    try:
        kind, value = pickle.loads(child.stdout)
    except (EOFError, pickle.UnpicklingError) as error:
        raise TooMuch(f"ends the process that looks at it ({child.returncode})") from error
    if kind == "memory":
        raise TooMuch(f"takes more than {memory >> 20} MiB of memory")
    if kind == "failed":
        raise TooMuch(f"ends the process that looks at it: {value}")
    if kind == "error":
        raise value
    return value


def serve() -> None:
    """Do the work that stands on the standard input; the child's part."""
    out = os.dup(1)
    silence = os.open(os.devnull, os.O_WRONLY)
    os.dup2(silence, 1)  # whatever the work prints
    module, name, arguments, memory, seconds = pickle.loads(sys.stdin.buffer.read())
    work = getattr(importlib.import_module(module), name)
    bound(memory, seconds)
    try:
        answer = ("value", work(*arguments))
    except TendonNewtonError as error:
        answer = ("error", error)
    except MemoryError:
        answer = ("memory", None)
    except Exception as error:  # a library that meets what it was never tried with
        answer = ("failed", f"{type(error).__name__}: {error}"[:LENGTH])
    with open(out, "wb") as file:  # noqa: PTH123  a descriptor, no path
        pickle.dump(answer, file)
    os._exit(0)  # what the work has left behind need not be taken apart


def bound(memory: int, seconds: int) -> None:
    """Bound this process from now on."""
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_FSIZE, (memory, memory))
    used = resource.getrusage(resource.RUSAGE_SELF)
    limit = int(used.ru_utime + used.ru_stime) + 1 + seconds
    resource.setrlimit(resource.RLIMIT_CPU, (limit, limit + 1))
    with contextlib.suppress(OSError):  # there is none but on Linux
        status = Path("/proc/self/status").read_text(encoding="ascii", errors="replace")
        own = int(re.findall(r"VmData:\s+(\d+) kB", status)[0]) << 10
        resource.setrlimit(resource.RLIMIT_DATA, (own + memory, own + memory))
