"""What training costs, before and after: a control step of what worlds hold, and learning.

``python -m lab.benchmarks.training --before OLD`` with an older clone at OLD, on a machine with a
GPU, writes ``lab/benchmarks/results/training.json``. Both trees run the rows of this file, each in
a process of its own. Hands hold a ball, fingers ask the authors' Transformer for their force, and
rsl-rl's PPO learns from fingers.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import time
from inspect import signature
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import torch
import warp as wp

from lab.benchmarks.network import authors_network, fused
from lab.benchmarks.timing import RESULTS, Row, best_time, circumstances, commit, say
from tendon_newton.data.model_file import Model, NamedValues
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.simulation.hosts.control_loop import ControlLoop
from tendon_train.policy.config.environment_config import EnvironmentConfig
from tendon_train.policy.config.policy_training_config import PolicyTrainingConfig
from tendon_train.policy.runs.policy_training import train_policy

STEP = 1.0e-3  # Longest substep of all rows but the Transformer's [s]
NETWORK_STEP = 5.0e-3  # At which fingers with the Transformer are sound [s]
CLOSING = 4.0  # Command that closes a hand on its ball [rad]
APART = 0.2  # By how much commands of fingers and hands differ [rad]
CLOSE_STEPS = 12  # Control steps until all fingers press
ITERATIONS, ITERATION_STEPS, EPOCHS, BATCHES = 10, 32, 4, 8
IDEAL = Model(actuator=NamedValues(name="ideal", values={"gain": 4.2, "spool_radius": 0.0125}))
ROWS = (("network_row", 65536), ("hand_row", 1024), ("hand_row", 16384), ("learning_row", 32768))
"""Functions of this file, and their worlds."""
NEW = Path(__file__).parents[2]
ASK = (
    "import json, runpy, sys; _, file, row, worlds = sys.argv;"
    "print(json.dumps(runpy.run_path(file)[row](int(worlds))))"
)
TIMES = ("milliseconds", "world_steps_per_second")


def main() -> None:
    """Run each row by this tree and by the older one, and write what they say."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--before", type=Path, required=True, help="a clone of an older commit")
    parser.add_argument("--commit", help="its commit, where it has no history")
    parser.add_argument("--out", type=Path, default=RESULTS / "training.json")
    chosen = parser.parse_args()
    if not (chosen.before / "tendon_newton").is_dir():
        parser.error(f"--before asks for a clone of an older commit; {chosen.before} is none")
    before = chosen.commit or commit(chosen.before)
    result = {**circumstances("python -m lab.benchmarks.training --before OLD"), "before": before}
    rows: list[Row] = []
    for row, worlds in ROWS:
        old, new = (asked(tree, row, worlds) for tree in (chosen.before.resolve(), NEW))
        rows.append({
            "engine": new["engine"], "worlds": worlds,
            **{f"before_{key}": old[key] for key in TIMES},
            **{f"after_{key}": new[key] for key in TIMES},
        })  # fmt: skip
        say(rows[-1])
        chosen.out.write_text(json.dumps({**result, "rows": rows}, indent=1) + "\n")


def asked(tree: Path, row: str, worlds: int) -> Row:
    """Return a row of one tree, measured in a process that finds no other."""
    paths = [str(tree / part) for part in ("", "hardware", "lab", "train")]
    rest = os.environ.get("PYTHONPATH", "")
    done = subprocess.run(
        [sys.executable, "-P", "-c", ASK, __file__, row, str(worlds)],
        env={**os.environ, "PYTHONPATH": os.pathsep.join([*paths, rest])},
        cwd=tree, capture_output=True, text=True, check=False,
    )  # fmt: skip
    if done.returncode:
        raise SystemExit(f"{tree}: {row} of {worlds} worlds failed:\n{done.stderr[-2000:]}")
    return json.loads(done.stdout.splitlines()[-1])


def network_row(worlds: int) -> Row:
    """Time a whole control step of fingers that ask the Transformer."""
    learned = Model(actuator=NamedValues(name="learned", values={"spool_radius": 0.0125}))
    name = "query" if "query" in signature(ControlLoop).parameters else "network"  # Older: `query`
    given: dict[str, Any] = {name: fused(authors_network())}
    loop = ControlLoop(
        load_mechanism("finger"), learned, worlds, **given,
        max_step=NETWORK_STEP, precision="float32", device=wp.get_device(),
    )  # fmt: skip
    return timed("finger, Transformer", loop, torch.full((worlds, 1), 2.0))


def hand_row(worlds: int) -> Row:
    """Time a control step of hands that hold a ball in their grip."""
    mechanism = load_mechanism("hand_ball")
    loop = ControlLoop(
        mechanism, IDEAL, worlds, max_step=STEP, precision="float32", device=wp.get_device()
    )
    way = torch.rand(worlds, loop.tendon_count, generator=torch.Generator().manual_seed(1))
    return timed("hand with a ball", loop, CLOSING + APART * way)


def timed(name: str, loop: ControlLoop, command: torch.Tensor) -> Row:
    """Return what a control step costs under a command [rad], shape (W, D)."""
    own = command.to(wp.device_to_torch(loop.device))
    loop.reset(torch.zeros_like(own))
    for k in range(CLOSE_STEPS):
        loop.step(own * min(1.0, (k + 1) / CLOSE_STEPS))
    seconds = best_time(lambda: loop.step(own), loop.device)
    loop.require_finite()
    return {
        "engine": name,
        "worlds": loop.world_count,
        "milliseconds": 1.0e3 * seconds,
        "world_steps_per_second": loop.world_count / seconds,
    }


def learning_row(worlds: int) -> Row:
    """Return the samples per second of a training: the median iteration after the first two."""
    ends: list[float] = []
    config = PolicyTrainingConfig(
        environment=EnvironmentConfig(worlds=worlds), iterations=ITERATIONS, steps=ITERATION_STEPS,
        batch=worlds * ITERATION_STEPS // BATCHES, epochs=EPOCHS, learning_rate=1.0e-3,
        checkpoint_every=ITERATIONS, device=wp.device_to_torch(wp.get_device()),
    )  # fmt: skip
    with TemporaryDirectory() as folder:
        train_policy(config, Path(folder), report=lambda _: ends.append(time.perf_counter()))
    seconds = float(np.median(np.diff(ends[2:])))
    return {
        "engine": "PPO",
        "worlds": worlds,
        "milliseconds": 1.0e3 * seconds,
        "world_steps_per_second": worlds * ITERATION_STEPS / seconds,
    }


if __name__ == "__main__":
    main()
