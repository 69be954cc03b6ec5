"""Sends spoilt files to workers and judges what they answer."""

import contextlib
import json
import select
import subprocess
import sys
import tempfile
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tests.fuzz.targets import PRODUCT, Target, groups_in

HANG = 5.0  # Longest time of a core that a file may take [s]
MEMORY = 1000.0  # Most memory that a file may take beyond the process's start [MB]
PATIENCE = 120.0
"""By the clock [s], on a computer that is busy with others; a worker that is silent longer ends."""


@dataclass
class Tally:
    """What came of the files of one run."""

    outcomes: dict[str, Counter[str]] = field(default_factory=lambda: defaultdict(Counter))
    """Target -> outcome -> files."""
    failures: list[str] = field(default_factory=list)
    slowest: float = 0.0
    largest: float = 0.0

    @property
    def files(self) -> int:
        """How many files were read."""
        return sum(sum(counts.values()) for counts in self.outcomes.values())

    def enter(self, name: str, number: int, answer: dict[str, Any]) -> None:
        """Note an answer, and keep it as a failure where it is one."""
        outcome = answer["outcome"]
        self.slowest = max(self.slowest, answer["seconds"])
        self.largest = max(self.largest, answer["megabytes"])
        if answer["seconds"] > HANG:
            outcome = f"took {answer['seconds']:.1f} s"
        if answer["megabytes"] > MEMORY:
            outcome = f"took {answer['megabytes']:.0f} MB"
        self.outcomes[name][outcome] += 1
        if outcome not in ("read", "refused"):
            self.failures.append(f"{name} {number}: {outcome}\n{answer['said']}")

    def text(self) -> str:
        """Say it in lines."""
        lines = [
            f"{name:18} " + ", ".join(f"{what} {n}" for what, n in sorted(counts.items()))
            for name, counts in sorted(self.outcomes.items())
        ]
        return "\n".join(
            [
                *lines,
                f"{self.files} files, {len(self.failures)} failures; the slowest took "
                f"{self.slowest:.1f} s of a core, the largest {self.largest:.0f} MB",
            ]
        )


def plan_of(
    targets: Mapping[str, Target], files: int, total: float, only: Sequence[str]
) -> list[tuple[str, int]]:
    """Return which files of a group are tried: target and number."""
    return [
        (name, number)
        for name, target in targets.items()
        if not only or name in only
        for number in range(max(1, round(files * target.share / total)))
    ]


def fuzz(
    files: int,
    *,
    seed: int = 0,
    jobs: int = 2,
    only: Sequence[str] = (),
    module: str = PRODUCT,
    report: Callable[[str], None] = lambda line: None,
) -> Tally:
    """Spoil about so many files and read each.

    Args:
        seed: Of all changes; a file is named by seed, target and number.
        jobs: Workers at the same time.
        only: Targets; all unless given.
        module: What has the targets.
    """
    groups = {name: make() for name, make in groups_in(module).items()}
    shares = [t.share for g in groups.values() for n, t in g.items() if not only or n in only]
    tally = Tally()

    def run(group: str) -> None:
        plan = plan_of(groups[group], files, sum(shares), only)
        for name, number, answer in answers(f"{module}:{group}", plan, seed):
            before = len(tally.failures)
            tally.enter(name, number, answer)
            for failure in tally.failures[before:]:
                report(failure)

    with ThreadPoolExecutor(jobs) as pool:
        list(pool.map(run, groups))
    return tally


def answers(
    group: str, plan: Sequence[tuple[str, int]], seed: int
) -> Iterator[tuple[str, int, dict[str, Any]]]:
    """Give each file to a worker; one that dies or is silent is replaced."""
    waiting = list(reversed(plan))
    while waiting:
        with tempfile.TemporaryDirectory() as folder:
            command = [sys.executable, "-m", "tests.fuzz.worker", group, str(seed), folder]
            worker = subprocess.Popen(
                command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE
            )
            try:
                while waiting:
                    name, number = waiting.pop()
                    answer = ask(worker, name, number)
                    yield name, number, answer
                    if answer["outcome"].startswith("the worker"):
                        break
            finally:
                worker.kill()
                worker.communicate()


def ask(worker: subprocess.Popen[bytes], name: str, number: int) -> dict[str, Any]:
    """Let a worker read one file."""
    line = b""
    try:
        worker.stdin.write(f"{name} {number}\n".encode())
        worker.stdin.flush()
        if select.select([worker.stdout], [], [], PATIENCE)[0]:
            line = worker.stdout.readline()
    except BrokenPipeError:
        pass
    if line:
        return json.loads(line)
    with contextlib.suppress(subprocess.TimeoutExpired):
        worker.wait(1.0)  # it may be about to say why
    worker.kill()
    said = worker.stderr.read().decode(errors="replace")[-2000:]
    how = f"the worker died or was silent for {PATIENCE:g} s"
    return {"outcome": how, "said": said, "seconds": 0.0, "megabytes": 0.0}


def write_failures(path: Path, tally: Tally) -> None:
    """Keep what went wrong."""
    path.write_text("\n\n".join(tally.failures) + "\n", encoding="utf-8")
