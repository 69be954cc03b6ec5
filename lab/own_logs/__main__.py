"""Nine strangers' logs, from files to names and numbers by the documented defaults alone.

``python -m lab.own_logs OUT`` writes the logs into ``OUT``, types the documented
commands there, and writes ``own_logs.json`` with what was found beside what was planted. What is
finished is not done again; ``--cases finger cart`` takes some.
"""

import argparse
import json
import os
import resource
import subprocess
import sys
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from lab.own_logs.cases import CASES, Case

NEAR = 0.1  # Share of a number by which what is found may differ from what was planted [1]


def main() -> None:
    """Make, diagnose and score."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path)
    parser.add_argument("--cases", nargs="+", default=list(CASES), choices=list(CASES))
    words = parser.parse_args()
    path = words.out / "own_logs.json"
    table: dict[str, Any] = json.loads(path.read_text()) if path.is_file() else {}
    for name in words.cases:
        if name not in table:
            table[name] = outcome(CASES[name], (words.out / name).resolve())
            path.write_text(json.dumps(table, indent=1) + "\n")
        right = [row["right"] for row in table[name]["diagnoses"].values()]
        print(f"{name:12s} {sum(right)} of {len(right)} right, {table[name]['wall_s']:.0f} s")


def outcome(case: Case, folder: Path) -> dict[str, Any]:
    """Write the logs of a case, type its commands, and say what came of them."""
    if folder.exists():
        raise SystemExit(f"{folder}: is there, of a run that was interrupted? Take it away first")
    folder.mkdir(parents=True)
    case.write(folder)
    environment = {**os.environ, "TENDON_NEWTON_ASSETS": str(folder)}
    commands: list[dict[str, Any]] = []
    for command in case.commands:
        words = command.split()
        start, before = time.monotonic(), resource.getrusage(resource.RUSAGE_CHILDREN)
        run = subprocess.run(
            [sys.executable, "-m", "tendon_newton", *words],
            cwd=folder,
            env=environment,
            capture_output=True,
            text=True,
            check=False,
        )
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        if run.returncode != (words[0] in case.failing):
            raise SystemExit(f"tendon-newton {command}: {run.stdout}\n{run.stderr}")
        commands.append(
            {
                "command": f"tendon-newton {command}",
                "wall_s": round(time.monotonic() - start, 1),
                "cpu_s": round(sum(after[:2]) - sum(before[:2]), 1),
            }
        )
    return {
        "commands": commands,
        "wall_s": round(sum(row["wall_s"] for row in commands), 1),
        "cpu_s": round(sum(row["cpu_s"] for row in commands), 1),
        "diagnoses": {
            part: scored(folder / part / "diagnosis.json", truth)
            for part, truth in case.truth.items()
        },
    }


def scored(path: Path, truth: Mapping[str, Mapping[str, float]]) -> dict[str, Any]:
    """Compare a diagnosis with what was planted: all names and no other, numbers near or inside.

    A cause that stands in the class of a named one is found, without its number.
    """
    said: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    found = {effect["name"]: effect for effect in said["effects"]}
    names = {
        next(
            (name for name in truth if name == named or name in effect["indistinguishable_from"]),
            named,
        )
        for named, effect in found.items()
    }
    near = all(
        abs(number["value"] - value) <= NEAR * abs(value)
        or number["ci95"][0] <= value <= number["ci95"][1]
        for name, numbers in truth.items()
        if name in found
        for key, value in numbers.items()
        for number in (found[name]["parameters"][key],)
    )
    return {
        "right": names == set(truth) and len(found) == len(truth) and near,
        "planted": truth,
        "verdict": said["verdict"],
        "actuator": said.get("actuator", {}).get("kind"),  # where the stated one was too simple
        "found": {
            name: {
                "numbers": {
                    key: [number["value"], *number["ci95"]]
                    for key, number in effect["parameters"].items()
                },
                "or": effect["indistinguishable_from"],
            }
            for name, effect in found.items()
        },
        "theta_rmse": [said["baseline"]["theta_rmse"], said["extended"]["theta_rmse"]],
        "force_rmse": [said["baseline"]["force_rmse"], said["extended"]["force_rmse"]],
    }


if __name__ == "__main__":
    main()
