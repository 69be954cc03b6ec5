"""Jobs of a study, each begun as soon as what it reads is there, on cores and on GPUs."""

from __future__ import annotations

import json
import time
from collections import Counter
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from dataclasses import dataclass
from pathlib import Path
from subprocess import CalledProcessError
from typing import Any

from tendon_newton.scheduler import JobOptions, core_count, open_executor


@dataclass(frozen=True, kw_only=True)
class Job:
    """A function of a module, and the files that it reads and makes."""

    makes: Path  # The file that it writes last
    needs: tuple[Path, ...] = ()
    work: Callable[..., str]
    what: tuple[Any, ...]  # Its arguments; one of a GPU has the device behind them
    on_device: bool = False
    threads: int = 1  # Cores that it keeps busy
    wanted: bool = False  # Whether it is made for itself, and not for what reads it
    brief: bool = False  # Whether it may begin when the time is over


@dataclass(frozen=True, kw_only=True)
class Places:
    """What jobs may take."""

    devices: tuple[str, ...]
    each: int  # Jobs side by side on each device
    cores: int
    until: float  # Instant of `time.monotonic` after which brief jobs alone begin [s]

    @staticmethod
    def of(devices: Sequence[str], each: int, cores: int | None, minutes: float) -> Places:
        """Return places for some minutes from now: all GPUs and cores unless some are named."""
        import torch

        found = [f"cuda:{k}" for k in range(torch.cuda.device_count())] or ["cpu"]
        until = time.monotonic() + 60.0 * minutes
        return Places(
            devices=tuple(devices or found),
            each=each,
            cores=cores or max(2, core_count()),
            until=until,
        )


def left(jobs: Sequence[Job]) -> list[Job]:
    """Return the jobs that are not done and on which something depends that is wanted."""
    by_file = {job.makes: job for job in jobs}
    kept: set[Path] = set()
    ahead = [job for job in jobs if job.wanted]
    while ahead:
        job = ahead.pop()
        if job.makes not in kept and not job.makes.exists():
            kept.add(job.makes)
            ahead += [by_file[file] for file in job.needs if file in by_file]
    return [job for job in by_file.values() if job.makes in kept]


def told(work: Callable[..., str], *what: Any) -> dict[str, Any]:
    """Do a job and say how it went: one that fails ends no other."""
    start = time.monotonic()
    try:
        said, failed = work(*what), False
    except CalledProcessError as error:
        words = " ".join(map(str, error.cmd[3:6]))
        said, failed = f"{work.__name__} {what[0]}: {words} ended with {error.returncode}", True
    except Exception as error:  # whatever it is, the other jobs go on
        said, failed = f"{work.__name__} {what[0]}: {error!r}", True
    return {"said": said, "failed": failed, "seconds": round(time.monotonic() - start, 1)}


class Running:
    """Jobs in the order of their worth, those that run now, and what they take."""

    def __init__(
        self, jobs: Sequence[Job], places: Places, cores: Executor, devices: Executor
    ) -> None:
        self._waiting, self._places = list(jobs), places
        self._cores, self._devices = cores, devices
        self._now: dict[Future[dict[str, Any]], tuple[str, int]] = {}  # place and cores taken

    def begin_ready(self) -> None:
        """Begin what can be done now."""
        for job in list(self._waiting):
            late = time.monotonic() > self._places.until and not job.brief
            if late or not all(file.exists() for file in job.needs):
                continue
            taken: Counter[str] = Counter()
            for place, threads in self._now.values():
                taken[place] += threads
            if job.on_device:
                device = min(self._places.devices, key=taken.__getitem__)
                if taken[device] >= self._places.each:
                    continue
                future = self._devices.submit(told, job.work, *job.what, device)
                self._now[future] = device, 1
            else:
                if taken["core"] and taken["core"] + job.threads > self._places.cores:
                    continue
                future = self._cores.submit(told, job.work, *job.what)
                self._now[future] = "core", job.threads
            self._waiting.remove(job)

    def next_ended(self) -> dict[str, Any] | None:
        """Wait for the next job that ends, and return how it went; none runs any more."""
        if not self._now:
            return None
        future = next(iter(wait(self._now, return_when=FIRST_COMPLETED).done))
        place, _ = self._now.pop(future)
        return {"place": place, **future.result(), "waiting": len(self._waiting)}


def run(jobs: Sequence[Job], places: Places, out: Path, ended: Callable[[], object]) -> None:
    """Do what is left of some jobs, those of more worth first.

    What failed is tried once. ``jobs.jsonl`` gets a line for each job.

    Args:
        ended: Called after each job.
    """
    start = time.monotonic()
    trainers = JobOptions(jobs=max(2, places.each * len(places.devices)))
    with (
        open_executor(JobOptions(jobs=places.cores)) as on_cores,
        open_executor(trainers) as on_devices,
    ):
        running = Running(left(jobs), places, on_cores, on_devices)
        running.begin_ready()
        while (line := running.next_ended()) is not None:
            time_left = round(places.until - time.monotonic(), 1)
            said = {"at": round(time.monotonic() - start, 1), **line, "seconds_left": time_left}
            print(json.dumps(said), flush=True)
            with (out / "jobs.jsonl").open("a", encoding="utf-8") as lines:
                lines.write(json.dumps(said) + "\n")
            ended()
            running.begin_ready()


def failures(out: Path) -> list[str]:
    """Return what failed jobs said, in all runs of a folder."""
    path = out / "jobs.jsonl"
    lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    return [row["said"] for row in map(json.loads, lines) if row["failed"]]
