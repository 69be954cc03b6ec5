"""From a virtual bench to named causes: what the diagnosis leaves, and which names are deserved.

``python -m lab.studies.units 50 51 52 --out DIR [--plan paper] [--wear planted] [--jobs N]``
``python -m lab.studies.units --out DIR --score`` scores what is in DIR.

Each unit is recorded and diagnosed by the two commands that a newcomer types, from the data sheet's
servo. What is in DIR already is not done again. A unit's plant is written beside its recordings.
``faults_N.json`` says how far each fault moves the test runs, ``score.json`` has the result.
"""

import argparse
import json
import subprocess
import sys
import time
import tomllib
from collections.abc import Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

from lab.studies.unit_faults import faults_of
from lab.studies.unit_score import Mark, mark, summary
from tendon_newton.data.files.json_file import write_json
from tendon_newton.data.files.origin import git_commit
from tendon_newton.scheduler import JobOptions, completed

PROGRAM = (sys.executable, "-m", "tendon_newton")
SCORE = "score.json"


def timed(arguments: Sequence[str], log: Path) -> float:
    """Run a command of the program, its words to a file, and return its wall time [s]."""
    start = time.monotonic()
    with log.open("w", encoding="utf-8") as words:
        subprocess.run([*PROGRAM, *arguments], stdout=words, stderr=words, check=True)
    return time.monotonic() - start


def answer_of(unit: int, *, plan: str, wear: str, out: Path, budget: str | None) -> Mark:
    """Record and diagnose one unit unless that is done, and score the answer."""
    recordings, found = out / f"recordings_{unit}", out / f"answer_{unit}"
    times = out / f"seconds_{unit}.json"
    seconds = read(times) if times.exists() else {}
    commands = {
        "collect": ("--plan", plan, "--port", f"virtual::{unit}:{wear}", "--faster-than-real-time",
                    "--out", str(recordings)),
        "diagnose": (str(recordings), "--out", str(found),
                     *(() if budget is None else ("--budget", budget))),
    }  # fmt: skip
    for verb, arguments in commands.items():
        if verb not in seconds:
            seconds[verb] = timed((verb, *arguments), out / f"{verb}_{unit}.log")
            write_json(times, seconds)
    faults = out / f"faults_{unit}.json"
    if not faults.exists():
        write_json(faults, faults_of(unit, plan, wear))
    return score_of(unit, out)


def score_of(unit: int, out: Path) -> Mark:
    """Score the answer that a folder has for a unit."""
    return mark(
        unit,
        read(out / f"answer_{unit}" / "diagnosis.json"),
        truth_of(out / f"recordings_{unit}"),
        read(out / f"faults_{unit}.json"),
        read(out / f"seconds_{unit}.json"),
    )


def read(path: Path) -> Any:
    """Return the contents of a JSON file that a run has left."""
    return json.loads(path.read_text(encoding="utf-8"))


def truth_of(recordings: Path) -> dict[str, list[dict[str, float]]]:
    """Return the plant's effects with their numbers on each bench."""
    truth: dict[str, list[dict[str, float]]] = {}
    for file in sorted(recordings.glob("plant_*.toml")):
        for effect in tomllib.loads(file.read_text(encoding="utf-8"))["effects"]:
            truth.setdefault(effect["name"], []).append(effect.get("parameters", {}))
    return truth


def answered(out: Path) -> list[int]:
    """Return the units whose answers a folder has."""
    return sorted(int(p.parent.name.split("_")[1]) for p in out.glob("answer_*/diagnosis.json"))


def main() -> None:
    """Print a row for each unit and what they come to."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("units", type=int, nargs="*")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--plan", default="quick")
    parser.add_argument("--wear", default="new")
    parser.add_argument("--budget")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--score", action="store_true", help="score what is there, do nothing anew")
    a = parser.parse_args()
    a.out.mkdir(parents=True, exist_ok=True)
    units = a.units or answered(a.out)
    if not units:
        parser.error(f"give units: {a.out} has no answer_N/diagnosis.json to score")
    work = partial(answer_of, plan=a.plan, wear=a.wear, out=a.out, budget=a.budget)
    if a.score:
        work = partial(score_of, out=a.out)
    marks: list[Mark] = []
    for _, found in completed(work, units, JobOptions(jobs=a.jobs)):
        marks.append(found)
        print(found.text, flush=True)
    marks.sort(key=lambda each: each.unit)
    total = summary(marks)
    origin = {"command": " ".join(("python -m lab.studies.units", *sys.argv[1:])),
              "commit": git_commit(), "seeds": [each.unit for each in marks]}  # fmt: skip
    rows = [asdict(each) for each in marks]
    write_json(a.out / SCORE, {**origin, "summary": total, "units": rows})
    print(json.dumps(total, indent=1))


if __name__ == "__main__":
    main()
