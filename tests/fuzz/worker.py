"""A process that spoils and reads files of one group, and watches itself while it does.

It is told ``target number`` line by line and answers each with a line of JSON. A file that does not
come back within the parent's patience ends it.
"""

import ctypes
import json
import logging
import os
import resource
import shutil
import sys
import time
import traceback
import warnings
from contextlib import contextmanager
from pathlib import Path
from random import Random
from typing import Any

from tendon_newton.errors import TendonNewtonError
from tests.bad_input.memory import peak_memory
from tests.fuzz.targets import Target, groups_in

MESSAGE_LIMIT = 4000
"""Longest message [characters]: some name a path of 1000, and forty names of 80."""
IN_OPEN, NONBLOCK = 0x20, 0o4000


class Canary:
    """A file outside every spoilt folder, and a watch on who opens it, libraries included."""

    def __init__(self, folder: Path) -> None:
        folder.mkdir()
        self.path = folder / "secret.txt"
        self.path.write_text("canary,canary\n1,2\n")
        system = ctypes.CDLL(None, use_errno=True)
        self._watch = system.inotify_init1(NONBLOCK)
        if (
            self._watch < 0
            or system.inotify_add_watch(self._watch, os.fsencode(self.path), IN_OPEN) < 0
        ):
            raise OSError(ctypes.get_errno(), "inotify")

    def was_opened(self) -> bool:
        """Say whether anybody has opened it since the last time."""
        try:
            return bool(os.read(self._watch, 1 << 16))
        except BlockingIOError:
            return False


@contextmanager
def silence() -> Any:
    """Keep what libraries write off the terminal."""
    saved, nothing = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nothing, 2)
    try:
        yield
    finally:
        os.dup2(saved, 2)
        os.close(saved)
        os.close(nothing)


def core_time() -> float:
    """Return how long this process and its children have used a core [s]."""
    return sum(
        usage.ru_utime + usage.ru_stime
        for usage in map(resource.getrusage, (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    )


def examine(target: Target, path: Path, canary: Canary) -> dict[str, Any]:
    """Read a spoilt file and say what came of it."""
    began, outcome, said = core_time(), "read", ""
    canary.was_opened()
    with peak_memory() as peak:
        try:
            with warnings.catch_warnings(), silence():
                warnings.simplefilter("ignore")  # a changed weight may overflow
                target.read(path)
        except TendonNewtonError as error:
            outcome, said = "refused", str(error)
            if len(said) > MESSAGE_LIMIT:
                outcome = "told at length"
        except Exception:  # whatever else comes is what is looked for
            lines = [line[:200] for line in traceback.format_exc().splitlines()]
            outcome, said = "traceback", "\n".join(lines)
    if canary.was_opened() or "canary" in said:
        outcome = "opened a foreign file"
    return {
        "outcome": outcome,
        "said": said[-MESSAGE_LIMIT:],
        "seconds": core_time() - began,
        "megabytes": peak.size / 1e6,
    }


class Workshop:
    """Sound folders, each made and read once, and the copies that are spoilt."""

    def __init__(self, folder: Path, seed: int) -> None:
        self._folder, self._seed = folder, seed
        self._places: dict[str, Path] = {}

    def spoilt(self, name: str, target: Target, number: int) -> Path:
        """Copy a sound folder and spoil its file."""
        sound, case = self._folder / "sound" / name, self._folder / "case"
        if name not in self._places:
            sound.mkdir(parents=True)
            self._places[name] = target.prepare(sound).relative_to(sound)
            with silence():
                target.read(self._copied(sound, case) / self._places[name])  # what is sound is read
        path = self._copied(sound, case) / self._places[name]
        rng = Random(f"{self._seed} {name} {number}")
        path.write_bytes(target.change(path.read_bytes(), rng))
        return path

    @staticmethod
    def _copied(sound: Path, case: Path) -> Path:
        shutil.rmtree(case, ignore_errors=True)
        shutil.copytree(sound, case)
        return case


def main() -> None:
    """Answer the parent."""
    group, seed, folder = sys.argv[1], int(sys.argv[2]), Path(sys.argv[3])
    logging.disable(logging.CRITICAL)
    os.environ["XDG_CONFIG_HOME"] = str(folder / "config")
    out = os.fdopen(os.dup(1), "w")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    module, _, name = group.partition(":")
    targets, canary = groups_in(module)[name](), Canary(folder / "outside")
    workshop = Workshop(folder, seed)
    for line in sys.stdin:
        name, number = line.split()
        path = workshop.spoilt(name, targets[name], int(number))
        began = time.monotonic()
        answer = examine(targets[name], path, canary)
        out.write(json.dumps(answer | {"clock": time.monotonic() - began}) + "\n")
        out.flush()


if __name__ == "__main__":
    main()
