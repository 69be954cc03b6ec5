"""How long the worlds of a training take to make, after the imports and with compiled kernels.

Run from the root of the repository::

    python -m tests.benchmarks.environments

Each number of worlds is made in a process of its own, as a verb does it, the best of three. It
writes ``tests/benchmarks/results/environments_cpu.json``; seconds that the process itself computed.
"""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

from tests.benchmarks.timing import RESULTS, circumstances, say

ROOT = Path(__file__).parents[2]
RUNS = 3
WORLDS = (64, 4096, 65_536)
PROGRAM = """
import gc, sys, time
from tendon_newton.cli import COLLECT_AFTER
gc.set_threshold(COLLECT_AFTER)
from train.policy.config.environment_config import EnvironmentConfig
from train.policy.worlds.environment import FingerEnvironment
begun = time.process_time()
FingerEnvironment(EnvironmentConfig(worlds=int(sys.argv[1])))
print(time.process_time() - begun)
"""


def seconds(worlds: int) -> float:
    """Make the worlds of a training; return the computing time that it took [s]."""
    command = [sys.executable, "-c", PROGRAM, str(worlds)]
    made = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True)
    return float(made.stdout.split()[-1])


def main() -> None:
    """Time every number of worlds and write the file."""
    rows = []
    for worlds in WORLDS:
        rows.append({"worlds": worlds, "cpu_seconds": min(seconds(worlds) for _ in range(RUNS))})
        say(rows[-1])
    result = {**circumstances("python -m tests.benchmarks.environments"), "rows": rows}
    (RESULTS / "environments_cpu.json").write_text(json.dumps(result, indent=1) + "\n")


if __name__ == "__main__":
    main()
