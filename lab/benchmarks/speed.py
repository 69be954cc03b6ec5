"""Measure what a control step costs on one CPU core, and write the figures.

Run from the root of the repository as `python -m lab.benchmarks.speed`. It writes
``lab/benchmarks/results/speed_cpu.json``, or what ``--out`` names: the parts of
`lab.benchmarks.gpu` with MuJoCo in C beside the other engines, by the same checks, in the time that
the process itself computed.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path

import numpy as np
import torch
import warp as wp

from lab.benchmarks.gpu import measure
from lab.benchmarks.mechanics import CPU_ENGINES, mechanics
from lab.benchmarks.network import network
from lab.benchmarks.timing import RESULTS, Row, best_time, say
from tendon_newton.gradients.differentiable import DifferentiableRollout
from tendon_newton.mechanisms.loading import load_mechanism
from tests.physics.runs import ideal_model, run_of, stairs

WORLDS = (1, 64, 1024)
GRADIENT_WORLDS = (1, 64)


def gradient(worlds_asked: Sequence[int]) -> Iterator[Row]:
    """Time a taped second of simulation forwards and backwards."""
    for worlds in (w for w in worlds_asked if w in GRADIENT_WORLDS):
        row = {"engine": "DifferentiableRollout", "worlds": worlds, **gradient_times(worlds)}
        say(row)
        yield row


def gradient_times(worlds: int) -> dict[str, float]:
    """Return the time [ms] of a taped second of simulation forwards and backwards."""
    rng = np.random.default_rng(3)
    runs = [run_of(stairs(rng, 81, 1.0, 3.0, 20)) for _ in range(worlds)]
    model = ideal_model(coulomb_friction={"force": 0.5}, viscous_friction={"coefficient": 0.3})
    rollout = DifferentiableRollout(load_mechanism("finger"), runs, model, time_step=5.0e-4)
    seed = np.ones((*rollout.forward().motor_position.shape, 1))
    for _ in range(2):
        rollout.forward()
        rollout.backward(motor_position=seed)
    seconds = {
        name: best_time(
            lambda graph=rollout.graphs[name]: wp.capture_launch(graph), wp.get_device()
        )
        for name in ("forward", "backward")
    }
    return {
        **{f"{name}_milliseconds": 1.0e3 * value for name, value in seconds.items()},
        "backward_over_forward": seconds["backward"] / seconds["forward"],
    }


def main() -> None:
    """Measure everything."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=RESULTS / "speed_cpu.json")
    out: Path = parser.parse_args().out
    torch.set_num_threads(1)
    parts = {
        "mechanics": partial(mechanics, engines=CPU_ENGINES),
        "network": network,
        "gradient": gradient,
    }
    with wp.ScopedDevice("cpu"):
        measure(parts, WORLDS, out, "python -m lab.benchmarks.speed")


if __name__ == "__main__":
    main()
