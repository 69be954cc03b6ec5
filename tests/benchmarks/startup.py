"""How long a user waits: commands from start to end, each in a process of its own.

Run from the root of the repository, for both parts or one of them::

    python -m tests.benchmarks.startup [commands] [worlds]

Each command runs first with an empty kernel cache, then with that of the first run (the best of
three); seconds by the clock, so the machine should be quiet. The worlds of a training are made with
compiled kernels, after the imports (the best of three); seconds that the process itself computed.
A part replaces its own rows in ``tests/benchmarks/results/startup_cpu.json``.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from tests.benchmarks.timing import RESULTS, Row, circumstances, say

ROOT = Path(__file__).parents[2]
EXAMPLE = ROOT / "examples" / "hidden_friction"
MODEL = EXAMPLE / "model.toml"
RESULT = RESULTS / "startup_cpu.json"
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
WORLDS = (64, 4096, 65_536)
ENVIRONMENT = """
import gc, sys, time
from tendon_newton.cli import COLLECT_AFTER
gc.set_threshold(COLLECT_AFTER)
from train.policy.config.environment_config import EnvironmentConfig
from train.policy.worlds.environment import FingerEnvironment
begun = time.process_time()
FingerEnvironment(EnvironmentConfig(worlds=int(sys.argv[1])))
print(time.process_time() - begun)
"""
"""Makes the worlds of a training as a verb does."""


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


def computing_seconds(worlds: int) -> float:
    """Make the worlds of a training; return the computing time that it took [s]."""
    command = [sys.executable, "-c", ENVIRONMENT, str(worlds)]
    made = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True)
    return float(made.stdout.split()[-1])


def time_commands() -> list[Row]:
    """Time every command."""
    rows = []
    for name, command in COMMANDS.items():
        with tempfile.TemporaryDirectory() as cache:
            cold = seconds(command, Path(cache))
            warm = min(seconds(command, Path(cache)) for _ in range(WARM_RUNS))
        rows.append({"what": name, "cold_seconds": round(cold, 2), "warm_seconds": round(warm, 2)})
        say(rows[-1])
    return rows


def time_worlds() -> list[Row]:
    """Time every number of worlds."""
    rows = []
    for worlds in WORLDS:
        best = min(computing_seconds(worlds) for _ in range(WARM_RUNS))
        rows.append({"worlds": worlds, "cpu_seconds": round(best, 2)})
        say(rows[-1])
    return rows


PARTS = {"commands": time_commands, "worlds": time_worlds}
"""What is timed, by its name in the file."""


def main() -> None:
    """Time the parts that were asked for, and write them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("parts", nargs="*", choices=[*PARTS, []], help="all without a name")
    result = json.loads(RESULT.read_text())
    for part in parser.parse_args().parts or PARTS:
        command = f"python -m tests.benchmarks.startup {part}"
        result[part] = {**circumstances(command), "rows": PARTS[part]()}
    RESULT.write_text(json.dumps(result, indent=2) + "\n")


if __name__ == "__main__":
    main()
