"""Jobs in turn, and in processes of this machine."""

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tendon_newton.errors import InvalidParameter
from tendon_newton.scheduler import InTurn, JobOptions, completed, core_count, open_executor
from tests.interpreters import search_path
from tests.scheduling.jobs import refuse, squared


def test_an_interrupt_ends_the_jobs_that_run() -> None:
    """Neither those that have begun nor those that wait in a process are waited for."""

    def interrupted() -> None:
        with open_executor(JobOptions(jobs=2)) as executor:
            for _ in range(6):
                executor.submit(time.sleep, 120.0)
            time.sleep(2.0)  # until they have begun
            raise KeyboardInterrupt

    begin = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert time.monotonic() - begin < 60.0


KILLED = """
import time
from tendon_newton.scheduler import JobOptions, open_executor
if __name__ == "__main__":
    with open_executor(JobOptions(jobs=2)) as executor:
        executor.submit(time.sleep, 120.0)
        executor.submit(time.sleep, 1.0).result()
        print(*executor._processes, flush=True)
        time.sleep(120.0)
"""


def test_a_killed_program_leaves_no_workers(tmp_path: Path) -> None:
    """Whoever is killed without a word takes those that it began with it."""
    (tmp_path / "killed.py").write_text(KILLED)
    words = [sys.executable, str(tmp_path / "killed.py")]
    environment = os.environ | {"PYTHONPATH": search_path(Path(__file__).parents[2])}
    with subprocess.Popen(words, env=environment, stdout=subprocess.PIPE) as program:
        workers = [int(word) for word in program.stdout.readline().split()]
        program.kill()
    assert len(workers) == 2
    deadline = time.monotonic() + 20.0
    while any(Path(f"/proc/{each}").exists() for each in workers):
        assert time.monotonic() < deadline, "they live on"
        time.sleep(0.1)


def test_jobs_in_turn_come_one_at_a_time() -> None:
    """The first result is there before the second job begins, in this process."""
    began = []

    def job(number: int) -> int:
        began.append(number)
        return number

    results = completed(job, [3, 4], JobOptions())
    assert next(results) == (3, 3)
    assert began == [3]
    assert list(results) == [(4, 4)]


def test_processes_share_the_cores() -> None:
    """Each result comes with its item; no process is this one, and each has its share of cores."""
    found = dict(completed(squared, [3, 4, 5], JobOptions(jobs=2)))
    assert {item: result[0] for item, result in found.items()} == {3: 9, 4: 16, 5: 25}
    assert {result[1] for result in found.values()} == {str(max(1, core_count() // 2))}
    assert os.getpid() not in {result[2] for result in found.values()}


@pytest.mark.parametrize("options", [JobOptions(), JobOptions(jobs=2)])
def test_an_error_of_a_job_is_raised(options: JobOptions) -> None:
    """As it is, whoever did the job."""
    with pytest.raises(InvalidParameter, match="must not be 2"):
        list(completed(refuse, [1, 2, 3], options))


def test_an_error_waits_in_its_future() -> None:
    """What does jobs in turn is an executor like others."""
    with open_executor(JobOptions()) as executor:
        assert isinstance(executor, InTurn)
        future = executor.submit(refuse, 2)
        assert isinstance(future.exception(), InvalidParameter)
        assert executor.submit(refuse, 1).result() == 1


@pytest.mark.parametrize("jobs", [0, 1025])
def test_there_is_at_least_one_process(jobs: int) -> None:
    """The message says how many there may be."""
    with pytest.raises(InvalidParameter, match="1 to 1024 processes"):
        JobOptions(jobs=jobs)


def test_only_cores_that_a_process_may_use_count() -> None:
    """A list of cores that it was given (taskset) is shared, not the whole computer."""
    assert 1 <= core_count() <= (os.cpu_count() or 1)
    if hasattr(os, "sched_getaffinity"):
        assert core_count() == len(os.sched_getaffinity(0))
