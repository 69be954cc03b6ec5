"""How long a user waits: commands from start to end, each in a process of its own.

Run from the root of the repository::

    python -m tests.benchmarks.startup

Each command runs first with an empty kernel cache, then with that of the first run (the best of
three). It writes ``tests/benchmarks/results/startup_cpu.json``; seconds by the clock, so the
machine should be quiet.
"""

from __future__ import annotations

import json
import os
import platform
import subprocess
import sys
import tempfile
import time
from datetime import UTC, datetime
from pathlib import Path

from tests.benchmarks.timing import RESULTS, commit

ROOT = Path(__file__).parents[2]
EXAMPLE = ROOT / "examples" / "hidden_friction"
MODEL = EXAMPLE / "model.toml"
WARM_RUNS = 3
REPLAY = ["simulate", str(EXAMPLE), "--model", str(MODEL), "--no-plots", "--out", "OUT"]
COMMANDS = {
    "help": ["--help"],
    "help of a verb": ["simulate", "--help"],
    "check an asset": ["asset", "check", "finger"],
    "simulate": REPLAY,
    "simulate with MuJoCo": [*REPLAY, "--solver", "mujoco"],
    "diagnose": ["diagnose", str(EXAMPLE), "--model", str(MODEL), "--out", "OUT"],
    "first iteration of a training": [
        "train-policy",
        "--worlds",
        "64",
        "--steps",
        "8",
        "--iterations",
        "1",
        "--out",
        "OUT",
    ],
}
"""What a user types behind ``tendon-newton``; OUT is an empty folder."""


def seconds(command: list[str], cache: Path) -> float:
    """Run a command once; return how long it took [s]."""
    with tempfile.TemporaryDirectory() as out:
        words = [out if word == "OUT" else word for word in command]
        environment = {**os.environ, "WARP_CACHE_PATH": str(cache)}
        begun = time.perf_counter()
        subprocess.run(
            [sys.executable, "-m", "tendon_newton", *words],
            cwd=ROOT,
            env=environment,
            check=True,
            capture_output=True,
        )
        return time.perf_counter() - begun


def main() -> None:
    """Time every command and write the file."""
    rows = {}
    for name, command in COMMANDS.items():
        with tempfile.TemporaryDirectory() as cache:
            cold = seconds(command, Path(cache))
            warm = min(seconds(command, Path(cache)) for _ in range(WARM_RUNS))
        rows[name] = {"cold_seconds": round(cold, 2), "warm_seconds": round(warm, 2)}
        sys.stdout.write(f"{name}: {cold:.2f} s, then {warm:.2f} s\n")
        sys.stdout.flush()
    result = {
        "command": "python -m tests.benchmarks.startup",
        "commit": commit(),
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "device": f"{platform.machine()}, {os.cpu_count()} cores",
        "commands": rows,
    }
    (RESULTS / "startup_cpu.json").write_text(json.dumps(result, indent=2) + "\n")


if __name__ == "__main__":
    main()
