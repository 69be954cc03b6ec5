"""Measure our solver against SolverMuJoCo and write the figures.

Run as `python -m tests.benchmarks.speed`.
"""

from __future__ import annotations

import json
import platform
import subprocess
import sys
import time
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import warp as wp

from tendon_newton.mechanisms.mechanism import load_mechanism
from tendon_newton.simulation.differentiable import DifferentiableRollout
from tests.benchmarks.engines import MODEL, Engine, MujocoEngine, TendonEngine, follow, rate
from tests.physics.runs import ideal_model, run_of, stairs

RESULTS = Path(__file__).parent / "results"
SAME_STEP = 1.0e-3  # s
LADDER = (1.0e-2, 5.0e-3, 2.5e-3, 1.25e-3, 1.0e-3, 6.25e-4, 5.0e-4, 2.5e-4, 1.25e-4, 6.25e-5)
"""Steps tried [s], longest first."""
ACCURACY = 2.0e-4
"""RMS error allowed at the rows [rad of a joint]."""
WORLDS = (1, 64, 1024)


def stepped_commands() -> np.ndarray:
    """Return 10 s of commands [rad], one every half second, that keep off the finger's stops."""
    return stairs(np.random.default_rng(7), 200, 1.0, 2.0, 10)


def largest_step(kind: type[Engine], reference: np.ndarray) -> tuple[float, dict[str, float]]:
    """Return an engine's largest accurate step [s], and the error [rad] of each step tried."""
    errors: dict[str, float] = {}
    for step in LADDER:
        run = follow(kind(1, step), stepped_commands())
        error = float(np.sqrt(np.mean((run - reference) ** 2)))
        errors[f"{step:g}"] = error
        if error < ACCURACY:
            return step, errors
    raise SystemExit(f"{kind.__name__} does not reach {ACCURACY} rad: {errors}")


def measure_rates(ours: float, theirs: float) -> dict[str, dict[str, float]]:
    """Return control steps per second of both engines at given steps, over numbers of worlds."""
    table = {}
    for worlds in WORLDS:
        ours_rate, theirs_rate = (
            engine_rate(kind(worlds, step), worlds)
            for kind, step in ((TendonEngine, ours), (MujocoEngine, theirs))
        )
        table[str(worlds)] = {
            "tendon": ours_rate, "mujoco": theirs_rate, "ratio": ours_rate / theirs_rate,
        }  # fmt: skip
    return table


def engine_rate(engine: Engine, worlds: int) -> float:
    """Return an engine's control steps per second in motion."""
    engine.command.fill_(1.0)
    engine.settle()
    engine.command.fill_(2.0)
    return rate(lambda: wp.capture_launch(engine.graph), worlds)


def gradient_times(worlds: int) -> dict[str, float]:
    """Return the time [s] of a taped second of simulation forwards and backwards."""
    rng = np.random.default_rng(3)
    runs = [run_of(stairs(rng, 81, 1.0, 3.0, 20)) for _ in range(worlds)]
    model = ideal_model(coulomb_friction={"force": 0.5}, viscous_friction={"coefficient": 0.3})
    rollout = DifferentiableRollout(
        load_mechanism("finger"), runs, model, time_step=5.0e-4, inline=True
    )
    seed = np.ones((*rollout.forward().motor_position.shape, 1))
    for _ in range(2):
        rollout.forward()
        rollout.backward(motor_position=seed)
    forward, backward = [], []
    for _ in range(7):
        marks = [time.perf_counter()]
        wp.capture_launch(rollout.graphs["forward"])
        wp.synchronize()
        marks.append(time.perf_counter())
        wp.capture_launch(rollout.graphs["backward"])
        wp.synchronize()
        marks.append(time.perf_counter())
        forward.append(marks[1] - marks[0])
        backward.append(marks[2] - marks[1])
    return {
        "forward_s": min(forward),
        "backward_s": min(backward),
        "ratio": min(backward) / min(forward),
    }


def commit() -> str:
    """Return the commit, marked where the working tree differs from it."""
    command = ["git", "describe", "--always", "--dirty", "--abbrev=12"]
    return subprocess.run(command, capture_output=True, text=True, check=False).stdout.strip()


def main() -> None:
    """Measure everything and write one file per device."""
    wp.config.quiet = True
    device = wp.get_device()
    reference = follow(TendonEngine(1, 2.0e-5, "float64"), stepped_commands())
    ours, our_errors = largest_step(TendonEngine, reference)
    theirs, their_errors = largest_step(MujocoEngine, reference)
    result: dict[str, Any] = {
        "command": "python -m tests.benchmarks.speed",
        "commit": commit(),
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "device": device.name if device.is_cuda else f"{platform.machine()} ({device.name})",
        "actuator": MODEL.actuator.name,
        "same_step_s": SAME_STEP,
        "same_step": measure_rates(SAME_STEP, SAME_STEP),
        "equal_accuracy_rad": ACCURACY,
        "equal_accuracy_steps_s": {"tendon": ours, "mujoco": theirs},
        "errors_rad": {"tendon": our_errors, "mujoco": their_errors},
        "equal_accuracy": measure_rates(ours, theirs),
        "gradient": {str(worlds): gradient_times(worlds) for worlds in (1, 64)},
    }
    RESULTS.mkdir(exist_ok=True)
    path = RESULTS / f"speed_{'cuda' if device.is_cuda else 'cpu'}.json"
    path.write_text(json.dumps(result, indent=2) + "\n")
    sys.stdout.write(path.read_text())


if __name__ == "__main__":
    main()
