"""What several GPUs of one machine bring to a training, a process each.

Run from the root of the repository, for as many GPUs as there are::

    torchrun --nproc-per-node 4 -m lab.benchmarks.processes

Each process has the same number of worlds; the samples per second of all together go to the part
``processes`` of ``lab/benchmarks/results/gpu.json``, a row per number of processes.
"""

import argparse
import json
import tempfile
from pathlib import Path

import torch

from lab.benchmarks.gpu import RESULT
from lab.benchmarks.learning import ITERATION_STEPS, iteration_time
from lab.benchmarks.timing import circumstances, say
from tendon_newton.device_code.quiet import quiet_warp
from tendon_train.policy.config.environment_config import EnvironmentConfig
from tendon_train.policy.runs.training_process import Process

WORLDS = 8192


def main() -> None:
    """Measure, and let the first process write."""
    argparse.ArgumentParser(description=__doc__).parse_args()
    quiet_warp()
    process = Process.own()
    torch.cuda.set_device(process.local_rank)
    with tempfile.TemporaryDirectory() as folder:
        seconds = iteration_time(EnvironmentConfig(worlds=WORLDS), Path(folder) / "policy")
    if process.rank > 0:
        return
    row = {
        "engine": "PPO, ideal",
        "gpus": process.count,
        "worlds": WORLDS * process.count,
        "milliseconds": 1.0e3 * seconds,
        "samples_per_second": WORLDS * process.count * ITERATION_STEPS / seconds,
    }
    say(row)
    result = json.loads(RESULT.read_text()) if RESULT.exists() else {}
    rows = [r for r in result.get("processes", {}).get("rows", []) if r["gpus"] != process.count]
    command = f"torchrun --nproc-per-node {process.count} -m lab.benchmarks.processes"
    result["processes"] = {**circumstances(command), "rows": [*rows, row]}
    RESULT.write_text(json.dumps(result, indent=1) + "\n")


if __name__ == "__main__":
    main()
