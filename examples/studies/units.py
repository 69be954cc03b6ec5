"""From a virtual bench to named causes: what the diagnosis leaves, and how much of it is true.

``python -m examples.studies.units 50 51 52 --out DIR [--plan paper] [--jobs N]``

Each unit is recorded and diagnosed by the two commands that a newcomer types, from the data sheet's
servo. What is in DIR already is not done again. A unit's plant is written beside its recordings, so
that causes and their intervals can be held against the truth.
"""

import argparse
import json
import subprocess
import sys
import time
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any

from tendon_newton.scheduler import JobOptions, completed

PROGRAM = (sys.executable, "-m", "tendon_newton")


@dataclass(frozen=True, kw_only=True)
class Answer:
    """What came of one unit."""

    verdict: str
    left: dict[str, float]
    """Share of the squared held-out error above the noise that is left, by signal [1]."""
    seconds: dict[str, float]
    """Wall time of each command [s]."""
    named: tuple[str, ...]
    true: tuple[str, ...]
    """Those of the named causes that the plant has, whatever it calls its numbers."""
    held: int
    """Numbers of the plant that lie inside their 95 % interval."""
    asked: int
    """Numbers that have an interval and that the plant states."""

    @property
    def removed(self) -> float:
        """Share of the squared held-out error that is gone, signals counting alike [1]."""
        return 1.0 - sum(self.left.values()) / len(self.left)


def timed(arguments: Sequence[str], log: Path) -> float:
    """Run a command of the program, its words to a file, and return its wall time [s]."""
    start = time.monotonic()
    with log.open("w", encoding="utf-8") as words:
        subprocess.run([*PROGRAM, *arguments], stdout=words, stderr=words, check=True)
    return time.monotonic() - start


def answer_of(unit: int, *, plan: str, out: Path, budget: str | None) -> Answer:
    """Record and diagnose one unit, or read what was found before."""
    recordings, found = out / f"recordings_{unit}", out / f"answer_{unit}"
    times = out / f"seconds_{unit}.json"
    seconds = json.loads(times.read_text(encoding="utf-8")) if times.exists() else {}
    commands = {
        "collect": ("--plan", plan, "--port", f"virtual::{unit}", "--faster-than-real-time",
                    "--out", str(recordings)),
        "diagnose": (str(recordings), "--out", str(found),
                     *(() if budget is None else ("--budget", budget))),
    }  # fmt: skip
    for verb, arguments in commands.items():
        if verb not in seconds:
            seconds[verb] = timed((verb, *arguments), out / f"{verb}_{unit}.log")
            times.write_text(json.dumps(seconds), encoding="utf-8")
    diagnosis = json.loads((found / "diagnosis.json").read_text(encoding="utf-8"))
    return compare(diagnosis, truth_of(recordings), seconds)


def truth_of(recordings: Path) -> dict[str, list[dict[str, float]]]:
    """Return the plant's effects with their numbers on each bench."""
    truth: dict[str, list[dict[str, float]]] = {}
    for file in sorted(recordings.glob("plant_*.toml")):
        for effect in tomllib.loads(file.read_text(encoding="utf-8"))["effects"]:
            truth.setdefault(effect["name"], []).append(effect.get("parameters", {}))
    return truth


def compare(
    diagnosis: dict[str, Any], truth: dict[str, list[dict[str, float]]], seconds: dict[str, float]
) -> Answer:
    """Hold an answer against the plant."""
    left: dict[str, float] = {}
    for signal in ("theta", "force"):
        noise = diagnosis["noise_floor"].get(signal)
        if noise is not None:
            before, after = (diagnosis[k][f"{signal}_rmse"] for k in ("baseline", "extended"))
            left[signal] = max(0.0, after**2 - noise**2) / (before**2 - noise**2)
    held = asked = 0
    for effect in diagnosis["effects"]:
        for name, estimate in effect["parameters"].items():
            stated = [numbers[name] for numbers in truth.get(effect["name"], []) if name in numbers]
            low, high = estimate["ci95"]
            asked += bool(stated)
            held += bool(stated) and low <= median(stated) <= high
    named = tuple(effect["name"] for effect in diagnosis["effects"])
    return Answer(
        verdict=diagnosis["verdict"],
        left=left,
        seconds=seconds,
        named=named,
        true=tuple(name for name in named if name in truth),
        held=held,
        asked=asked,
    )


def main() -> None:
    """Print a row for each unit and what they come to."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("units", type=int, nargs="+")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--plan", default="quick")
    parser.add_argument("--budget")
    parser.add_argument("--jobs", type=int, default=1)
    a = parser.parse_args()
    a.out.mkdir(parents=True, exist_ok=True)
    work = partial(answer_of, plan=a.plan, out=a.out, budget=a.budget)
    answers: list[Answer] = []
    print("unit  verdict            removed  angle left  force left  collect  diagnose  causes")
    for unit, found in completed(work, a.units, JobOptions(jobs=a.jobs)):
        answers.append(found)
        false = [name for name in found.named if name not in found.true]
        print(
            f"{unit:4d}  {found.verdict:17s}  {found.removed:6.1%}  "
            f"{found.left.get('theta', 0.0):10.1%}  {found.left.get('force', 0.0):10.1%}  "
            f"{found.seconds['collect']:5.0f} s  {found.seconds['diagnose']:6.0f} s  "
            f"{', '.join(found.true)}; not in the plant: {', '.join(false) or 'none'}",
            flush=True,
        )
    two = sum(len(found.true) >= 2 for found in answers)
    print(
        f"{len(answers)} units: median removed {median(f.removed for f in answers):.1%}, "
        f"at least 80 % on {sum(f.removed >= 0.8 for f in answers)}; two true causes on {two}; "
        f"intervals hold {sum(f.held for f in answers)} of {sum(f.asked for f in answers)} numbers"
    )


if __name__ == "__main__":
    main()
