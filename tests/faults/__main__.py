"""The exam of faults: ``python -m tests.faults [rules|kill|soak] [--runs 20] [--hours 1]``.

``rules``, the default, makes every fault of the tables so many times on the virtual bench and
prints how often it was acted upon and how soon; ``--only WORDS`` takes those whose name has the
words. ``kill`` kills every verb that drives a motor, in real time: best on a machine that does
nothing else. ``soak`` deploys for hours of simulated time. The exit code is 1 where one was missed.
"""

import argparse
import statistics
import sys
import traceback
from collections.abc import Callable, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

from hardware.virtual_bench import VirtualPorts
from tests.faults.cases import CASES, moments
from tests.faults.collecting import COLLECTING
from tests.faults.kill import ALLOWED, WAYS, killed, policy_file
from tests.faults.outside import OUTSIDE
from tests.faults.soak import soak

Examination = Callable[[int], float | None]
"""One run of a fault by its number: the time to the action [s], if it can be timed."""
WIDTH = 46


def main() -> int:
    """Run the part that was asked for and return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m tests.faults", description=__doc__)
    parser.add_argument("part", nargs="?", choices=("rules", "kill", "soak"), default="rules")
    parser.add_argument("--runs", type=int, default=20, help="runs of each fault")
    parser.add_argument("--hours", type=float, default=1.0, help="simulated time of the soak")
    parser.add_argument("--only", default="", help="words in the name of a fault")
    arguments = parser.parse_args()
    if arguments.part == "soak":
        soak(arguments.hours, say)
        return 0
    if arguments.part == "kill":
        return kill(arguments.runs)
    every = [(name, run) for name, run in examinations(arguments.runs) if arguments.only in name]
    return table(every, arguments.runs)


def examinations(runs: int) -> Iterator[tuple[str, Examination]]:
    """Give every fault with its name."""
    when = moments(max(runs, 1))
    for name, case in CASES.items():
        target = f"{case.rule} {case.action}" if case.rule else "goes on"
        yield f"{name}: {target}", lambda k, case=case: case.examine(when[k])
    for name, case in COLLECTING.items():
        target = "off" if case.said else "goes on"
        yield f"collect, {name}: {target}", lambda k, case=case: case.examine(when[k])
    for name, run in OUTSIDE.items():
        yield name, run


def table(every: list[tuple[str, Examination]], runs: int) -> int:
    """Run all, print a row for each, and return 1 where one was missed."""
    say(f"{'fault: action':{WIDTH}s} {'n':>3s} {'acted':>5s}  latency median, longest [ms]")
    missed = 0
    for name, run in every:
        acted, took, trouble = 0, [], ""
        for k in range(runs):
            try:
                latency = run(k)
                acted += 1
                took += [] if latency is None else [1e3 * latency]
            except BaseException as error:
                if isinstance(error, KeyboardInterrupt):
                    raise
                trouble = trouble or "".join(traceback.format_exception_only(error)).strip()
        times = f"{statistics.median(took):6.0f}, {max(took):6.0f}" if took else "     -"
        say(f"{name:{WIDTH}s} {runs:3d} {acted:5d}  {times}{'' if acted == runs else '  MISSED'}")
        if trouble:
            say(f"    {trouble[:500]}")
        missed += runs - acted
    say(f"{len(every)} faults, {runs} runs each: {missed} missed")
    return min(missed, 1)


def kill(runs: int) -> int:
    """Kill every way of driving a motor and print how long the motor pulled on."""
    with TemporaryDirectory() as name, VirtualPorts(load_cell_rate=80) as ports:
        folder = Path(name)
        policy = policy_file(folder)

        def once(way: str, k: int) -> float:
            took = killed(ports, WAYS[way], folder / way / str(k), policy, 0.3 + 0.037 * k)
            assert took <= ALLOWED, f"{took:.3f} s"
            return took

        every = [(f"kill -9 of {way}", lambda k, way=way: once(way, k)) for way in WAYS]
        return table(every, runs)


def say(text: str) -> None:
    """Print at once."""
    sys.stdout.write(f"{text}\n")
    sys.stdout.flush()


if __name__ == "__main__":
    sys.exit(main())
