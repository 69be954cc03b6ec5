"""What training costs: a control step of what worlds hold, and an iteration of learning.

Hands hold a ball, fingers ask the authors' Transformer for their force, and rsl-rl's PPO learns
from fingers.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import torch
import warp as wp

from lab.benchmarks.network import Arithmetic, authors_network, fused, matrix_products
from lab.benchmarks.timing import Row, best_time, say
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
LOOP_WORLDS = (1024, 4096, 16384, 65536)
HAND_WORLDS = (1024, 4096, 16384)
PPO_WORLDS = (4096, 32768)
ITERATIONS, ITERATION_STEPS, EPOCHS, BATCHES = 10, 32, 4, 8
IDEAL = Model(actuator=NamedValues(name="ideal", values={"gain": 4.2, "spool_radius": 0.0125}))


def training(worlds_asked: Sequence[int]) -> Iterator[Row]:
    """Time all rows; those of learning last."""
    most = max(worlds_asked)
    for worlds in (w for w in LOOP_WORLDS if w <= most):
        yield network_row(worlds)
    for worlds in (w for w in HAND_WORLDS if w <= most):
        yield hand_row(worlds)
    for worlds in (w for w in PPO_WORLDS if w <= most):
        yield learning_row(worlds, "float32")
        yield learning_row(worlds, "TF32")


def network_row(worlds: int) -> Row:
    """Time a whole control step of fingers that ask the Transformer."""
    learned = Model(actuator=NamedValues(name="learned", values={"spool_radius": 0.0125}))
    loop = ControlLoop(
        load_mechanism("finger"), learned, worlds, query=fused(authors_network()),
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
    row: Row = {
        "engine": name,
        "worlds": loop.world_count,
        "milliseconds": 1.0e3 * seconds,
        "world_steps_per_second": loop.world_count / seconds,
    }
    say(row)
    return row


def learning_row(worlds: int, arithmetic: Arithmetic) -> Row:
    """Return the samples per second of a training: the median iteration after the first two."""
    ends: list[float] = []
    config = PolicyTrainingConfig(
        environment=EnvironmentConfig(worlds=worlds), iterations=ITERATIONS, steps=ITERATION_STEPS,
        batch=worlds * ITERATION_STEPS // BATCHES, epochs=EPOCHS, learning_rate=1.0e-3,
        checkpoint_every=ITERATIONS, device=wp.device_to_torch(wp.get_device()),
    )  # fmt: skip
    with TemporaryDirectory() as folder, matrix_products(arithmetic):
        train_policy(config, Path(folder), report=lambda _: ends.append(time.perf_counter()))
    seconds = float(np.median(np.diff(ends[2:])))
    row: Row = {
        "engine": f"PPO, {arithmetic}",
        "worlds": worlds,
        "milliseconds": 1.0e3 * seconds,
        "world_steps_per_second": worlds * ITERATION_STEPS / seconds,
    }
    say(row)
    return row
