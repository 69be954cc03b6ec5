"""What gradients of a run cost, and trainings of policies: samples per second."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import torch
import warp as wp

from lab.benchmarks.timing import Row, best_time, memory_in_use, say
from tendon_newton.data.recording import Recording
from tendon_newton.gradients.differentiable import DifferentiableRollout
from tendon_newton.gradients.taped_run import Adjoint
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_train.policy.config.environment_config import EnvironmentConfig
from tendon_train.policy.config.policy_training_config import PolicyTrainingConfig
from tendon_train.policy.runs.policy_training import train_policy
from tendon_train.policy.worlds.environment import FingerEnvironment
from tests.physics.learned.networks import force_network, write_force_network
from tests.physics.runs import ROWS, ideal_model, run_of, stairs

GRADIENT_WORLDS = (1, 64, 1024, 4096, 8192, 16384)
GRADIENT_STEP = 1.0e-3  # s
LONG_WORLDS = 4096  # Worlds of the run of 10 s
SEGMENTS = (1, 10, 100)  # Into how many parts it is divided
PPO_WORLDS = (8192, 32768)
ITERATIONS = 12
ITERATION_STEPS = 32


def gradient(worlds_asked: Sequence[int]) -> Iterator[Row]:
    """Time 2 s forwards and backwards by all numbers and commands; 10 s in one piece and more."""
    most = max(worlds_asked)
    runs = swinging_runs(max(GRADIENT_WORLDS), 2.0)
    ways = {"many substeps at once": True, "one substep after the other": False}
    for worlds in (w for w in GRADIENT_WORLDS if w <= most):
        for way, at_once in ways.items():
            yield gradient_row(way, runs[:worlds], Adjoint(at_once=at_once))
    if most >= LONG_WORLDS:
        runs = swinging_runs(LONG_WORLDS, 10.0)
        for segments in SEGMENTS:
            yield gradient_row(f"10 s in {segments} segments", runs, Adjoint(segments=segments))


def swinging_runs(count: int, duration: float) -> list[Recording]:
    """Return recordings of so many seconds, each with other commands."""
    rng = np.random.default_rng(3)
    rows = int(ROWS * duration) + 1
    return [run_of(stairs(rng, rows, 1.0, 3.0, int(10 * duration))) for _ in range(count)]


def gradient_row(name: str, runs: Sequence[Recording], adjoint: Adjoint) -> Row:
    """Time a differentiable rollout of a finger whose tendon rubs."""
    model = ideal_model(coulomb_friction={"force": 0.5}, viscous_friction={"coefficient": 0.3})
    before = memory_in_use()
    mechanism = load_mechanism("finger")
    rollout = DifferentiableRollout(
        mechanism, runs, model, time_step=GRADIENT_STEP, adjoint=adjoint
    )
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
    row = {
        "engine": name,
        "worlds": len(runs),
        **{f"{name}_milliseconds": 1.0e3 * value for name, value in seconds.items()},
        "backward_over_forward": seconds["backward"] / seconds["forward"],
        "bytes_per_world": (memory_in_use() - before) / len(runs),
    }
    say(row)
    return row


def ppo(worlds_asked: Sequence[int]) -> Iterator[Row]:
    """Time the environment alone, and whole iterations of a training."""
    with tempfile.TemporaryDirectory() as folder:
        network_file = write_force_network(
            Path(folder) / "force.pt", force_network(of_set="authors")
        )
        for worlds in (w for w in PPO_WORLDS if w <= max(worlds_asked)):
            for force in ("ideal", str(network_file)):
                name = "ideal" if force == "ideal" else "Transformer"
                config = EnvironmentConfig(worlds=worlds, force=force)
                environment = FingerEnvironment(config, device="cuda:0")
                action = torch.zeros(worlds, environment.num_actions, device="cuda")
                action.fill_(0.5)
                yield environment_row(f"environment, {name}", environment, action)
                del environment
                yield training_row(config, name, Path(folder) / f"{name}{worlds}")


def environment_row(name: str, environment: FingerEnvironment, action: torch.Tensor) -> Row:
    """Time steps of an environment alone."""
    seconds = best_time(lambda: environment.step(action), wp.get_device())
    row = {
        "engine": name,
        "worlds": len(action),
        "milliseconds": 1.0e3 * seconds,
        "world_steps_per_second": len(action) / seconds,
    }
    say(row)
    return row


def training_row(config: EnvironmentConfig, force: str, out: Path) -> Row:
    """Return the samples per second of a training, its first iterations left out."""
    seconds = iteration_time(config, out)
    row = {
        "engine": f"PPO, {force}",
        "worlds": config.worlds,
        "milliseconds": 1.0e3 * seconds,
        "samples_per_second": config.worlds * ITERATION_STEPS / seconds,
    }
    say(row)
    return row


def iteration_time(config: EnvironmentConfig, out: Path) -> float:
    """Return the seconds of an iteration of a training, the median without the first ones."""
    ends: list[float] = []
    training = PolicyTrainingConfig(
        environment=config,
        iterations=ITERATIONS,
        steps=ITERATION_STEPS,
        batch=4 * config.worlds,
        epochs=4,
        learning_rate=1.0e-3,
        checkpoint_every=ITERATIONS,
        device="cuda",
    )
    train_policy(training, out, report=lambda progress: ends.append(time.perf_counter()))
    return float(np.median(np.diff(ends[2:]))) if len(ends) > 2 else float("nan")
