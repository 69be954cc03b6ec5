"""Benchmark of doctors: ``python -m lab.benchmarks.corrupted_logs --seed 1 --draws 2 --out DIR``.

Makes logs with one fault each and their clean twins under ``DIR/logs``, with the truth in
``DIR/truth.json``, runs our doctor over them, and scores it beside constant answers and the
findings of other programs (``--findings NAME=FILE``, see ``score.py``; of `lerobot-doctor` and
`lerobot-lint` with ``--others PYTHON``, an interpreter that has both).
"""

import argparse
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np

from lab.benchmarks.corrupted_logs.faults import FAULTS, JOINT, Fault
from lab.benchmarks.corrupted_logs.logs import JOINTS, Log, clean_logs, write_log
from lab.benchmarks.corrupted_logs.our_doctor import found_by_ours
from lab.benchmarks.corrupted_logs.score import Findings, score
from tendon_newton.data.files.text_file import write_text

SIZES = ("small", "medium", "large")


def make(folder: Path, seed: int, draws: int) -> dict[str, Any]:
    """Write all logs and return the truth about them."""
    rng = np.random.default_rng(seed)
    truth: dict[str, Any] = {}
    clean = clean_logs(rng, draws * len(FAULTS))
    for place, (twin, log) in enumerate(zip(names(seed, draws), clean, strict=True)):
        fault = FAULTS[place % len(FAULTS)]
        write_log(folder / "logs" / twin, log)
        truth[twin] = {"kind": None, "twin": twin}
        for size in range(len(SIZES)):
            name = f"{twin}_{SIZES[size]}"
            truth[name] = spoilt(folder / "logs" / name, log.copy(), fault, size, rng, twin)
    write_text(folder / "truth.json", json.dumps(truth, indent=1) + "\n")
    return truth


def names(seed: int, draws: int) -> list[str]:
    """Return the names of clean logs, which do not tell the fault of their twins."""
    count = draws * len(FAULTS)
    order = np.random.default_rng(seed).permutation(count)
    return [f"log_{k:03d}" for k in order]


def spoilt(
    folder: Path, log: Log, fault: Fault, size: int, rng: np.random.Generator, twin: str
) -> dict[str, Any]:
    """Write a log with a fault and return its truth."""
    rows = fault.spoil(log, fault.sizes[size], rng)
    write_log(folder, log)
    places = {k: np.flatnonzero(own) for k, own in enumerate(rows) if own.any()}
    return {
        "kind": fault.kind,
        "size": size,
        "also": list(fault.also),
        "joint": None if fault.every else JOINTS[JOINT],
        "spoilt": {str(k): [int(own[0]), int(own[-1])] for k, own in places.items()},
        "twin": twin,
    }


def found_by_others(python: Path, folder: Path) -> dict[str, Findings]:
    """Run other programs in the interpreter that has them."""
    program = Path(__file__).with_name("other_doctors.py")
    words = [str(python), str(program), str(folder / "logs")]
    answer = subprocess.run(words, check=True, capture_output=True, text=True)
    return json.loads(answer.stdout.splitlines()[-1])


def main() -> None:
    """Make, run, score and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--draws", type=int, default=2, help="clean logs of each kind of fault")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--findings", nargs="*", default=[], help="NAME=FILE of other programs")
    parser.add_argument("--others", type=Path, help="interpreter with lerobot-doctor and -lint")
    chosen = parser.parse_args()
    truth = make(chosen.out, chosen.seed, chosen.draws)
    found: dict[str, Findings] = {"tendon-newton doctor": found_by_ours(chosen.out / "logs")}
    if chosen.others is not None:
        found |= found_by_others(chosen.others, chosen.out)
    for word in chosen.findings:
        name, _, file = word.partition("=")
        found[name] = json.loads(Path(file).read_text(encoding="utf-8"))
    always = [{"kind": "failed_read"}]
    found |= {"always failed_read": dict.fromkeys(truth, always), "finds nothing": {}}
    for name, own in found.items():
        path = chosen.out / f"{name.replace(' ', '_')}.json"
        write_text(path, json.dumps(own, indent=1) + "\n")
    table = {name: score(truth, own) for name, own in found.items()}
    figures = {"seed": chosen.seed, "draws": chosen.draws, "programs": table}
    write_text(chosen.out / "figures.json", json.dumps(figures, indent=1) + "\n")
    for name, own in table.items():
        sys.stdout.write(f"{name:24} {json.dumps({k: own[k] for k in SHOWN})}\n")


SHOWN = ("named", "seen", "rows_right", "clean_and_silent", "balanced", "named_by_size")


if __name__ == "__main__":
    main()
