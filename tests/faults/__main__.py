"""The exam of faults: ``python -m tests.faults [rules|kill|calm] [--runs 20] [--hours 1]``.

``rules``, the default, makes every fault of the tables so many times on the virtual bench and
prints how often it was acted upon and how soon; ``--only WORDS`` takes those whose name has the
words. ``kill`` harms every verb that drives a motor, in real time, with a servo of each family:
best on a machine that does nothing else. ``calm`` records and deploys for hours of simulated time
in which nothing is wrong, and counts the stops.
``--servos NAME`` kills with others; ``--json FILE`` adds the rows to a file. The exit code is 1
where one was missed.
"""

import argparse
import json
import statistics
import sys
import traceback
from collections.abc import Callable, Iterator, Sequence
from datetime import UTC, datetime
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from tendon_hardware.servos import SERVOS
from tendon_hardware.servos.families import FAMILIES
from tendon_hardware.virtual_bench import VirtualPorts
from tendon_newton.data.files.origin import git_commit
from tests.faults.calm import calm
from tests.faults.camera import CAMERA
from tests.faults.cases import CASES, moments
from tests.faults.collecting import COLLECTING
from tests.faults.kill import HARMS, WAYS, Release, released
from tests.faults.lies import LIES
from tests.faults.outside import OUTSIDE

Examination = Callable[[int], float | Release | None]
"""One run of a fault by its number: the time to the action [s], if it can be timed."""
WIDTH = 56
SERVOS_OF_BOTH = ("xc330_t288_t", "sts3215")  # A servo of each family, the bench's own first


def main() -> int:
    """Run the part that was asked for and return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m tests.faults", description=__doc__)
    parser.add_argument("part", nargs="?", choices=("rules", "kill", "calm"), default="rules")
    parser.add_argument("--runs", type=int, default=20, help="runs of each fault")
    parser.add_argument("--hours", type=float, default=1.0, help="simulated time of calm")
    parser.add_argument("--only", default="", help="words in the name of a fault")
    parser.add_argument("--servos", nargs="*", choices=SERVOS, default=SERVOS_OF_BOTH)
    parser.add_argument("--json", type=Path, help="file that gets the rows")
    arguments = parser.parse_args()
    if arguments.part == "calm":
        rows = [calm(arguments.hours, say)]
    elif arguments.part == "kill":
        rows = kill(arguments.runs, arguments.only, arguments.servos)
    else:
        every = [each for each in examinations(arguments.runs) if arguments.only in each[0]]
        rows = table(every, arguments.runs)
    if arguments.json is not None:
        keep(arguments.json, rows)
    missed = sum(row["runs"] - row["acted"] for row in rows)
    say(f"{len(rows)} faults, {sum(row['runs'] for row in rows)} runs: {missed} missed")
    return min(missed, 1)


def examinations(runs: int) -> Iterator[tuple[str, Examination]]:
    """Give every fault with its name."""
    when = moments(max(runs, 1))
    for name, case in (CASES | LIES).items():
        target = f"{case.rule} {case.action}" if case.rule else "goes on"
        for servo in SERVOS_OF_BOTH[case.strong : 1 if case.own else None]:
            yield (
                f"{servo}, {name}: {target}",
                lambda k, case=case, servo=servo: case.examine(when[k], servo),
            )
    for name, case in COLLECTING.items():
        target = "off" if case.said else "goes on"
        yield f"collect, {name}: {target}", lambda k, case=case: case.examine(when[k])
    for name, fault in CAMERA.items():
        yield f"{name}: {'lost' if fault.lost else 'goes on'}", fault.examine
    for name, run in OUTSIDE.items():
        yield name, run


def table(every: list[tuple[str, Examination]], runs: int) -> list[dict[str, Any]]:
    """Run all, print a row for each, and return the rows."""
    say(f"{'fault: action':{WIDTH}s} {'n':>3s} {'acted':>5s}  latency median, longest [ms]")
    rows = [row_of(name, run, runs) for name, run in every]
    return rows


def row_of(name: str, run: Examination, runs: int) -> dict[str, Any]:
    """Run one fault so many times, print its row and return it."""
    found: list[float | Release | None] = []
    trouble = ""
    for k in range(runs):
        try:
            found.append(run(k))
        except KeyboardInterrupt:
            raise
        except BaseException as error:
            trouble = trouble or "".join(traceback.format_exception_only(error)).strip()[:500]
    took = [1e3 * (x.took if isinstance(x, Release) else x) for x in found if x is not None]
    held = [x.held for x in found if isinstance(x, Release)]
    median, longest = (statistics.median(took), max(took)) if took else (None, None)
    times = "     -" if not took else f"{median:6.0f}, {longest:6.0f}"
    force = f", held {max(held):.0f} N" if held else ""
    missed = "" if len(found) == runs else f"  MISSED\n    {trouble}"
    say(f"{name:{WIDTH}s} {runs:3d} {len(found):5d}  {times}{force}{missed}")
    return {
        "fault": name,
        "runs": runs,
        "acted": len(found),
        "median_ms": None if median is None else round(median, 1),
        "longest_ms": None if longest is None else round(longest, 1),
        "held_n": round(max(held), 1) if held else None,
        "trouble": trouble,
    }


def kill(runs: int, only: str, servos: Sequence[str]) -> list[dict[str, Any]]:
    """Harm every way of driving a motor of each family, and return how long the motor pulled on."""
    rows: list[dict[str, Any]] = []
    for servo in servos:
        unwatched = FAMILIES[SERVOS[servo].family].forgets is not None
        with TemporaryDirectory() as name, VirtualPorts(load_cell_rate=80, servo=servo) as ports:
            folder = Path(name)
            every = [
                (
                    f"{servo}, {way}: {harm}",
                    lambda k, way=way, harm=harm, folder=folder, ports=ports, servo=servo: released(
                        ports,
                        WAYS[way],
                        HARMS[harm],
                        folder / way / harm / str(k),
                        0.3 + 0.037 * k,
                        servo,
                    ),
                )
                for way in WAYS
                for harm in HARMS
                if (unwatched or not HARMS[harm].kept)
                and (servo == SERVOS_OF_BOTH[0] or not WAYS[way].by_card)
            ]
            rows += table([each for each in every if only in each[0]], runs)
    return rows


def keep(path: Path, rows: list[dict[str, Any]]) -> None:
    """Add rows to a file, with where they come from."""
    origin = {
        "command": " ".join(["python -m tests.faults", *sys.argv[1:]]),
        "commit": git_commit(),
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
    }
    before = json.loads(path.read_text()) if path.exists() else []
    path.write_text(json.dumps([*before, origin | {"rows": rows}], indent=1) + "\n")


def say(text: str) -> None:
    """Print at once."""
    sys.stdout.write(f"{text}\n")
    sys.stdout.flush()


if __name__ == "__main__":
    sys.exit(main())
