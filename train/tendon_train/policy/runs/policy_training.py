"""Train a policy: rsl-rl's PPO on the fingers of one or several devices."""

import contextlib
import io
import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch

from tendon_newton.data.files.origin import file_hash
from tendon_newton.mechanisms.usd.stage_file import layers_of
from tendon_train.policy.config.policy_training_config import (
    PolicyTrainingConfig,
    exploration_at,
    learning_rate_at,
    to_rsl_rl,
)
from tendon_train.policy.runs.curve import CurveLogger, CurvePoint, Progress
from tendon_train.policy.runs.forecast import Forecast, timed
from tendon_train.policy.runs.policy_checkpoint import (
    load_checkpoint,
    save_checkpoint,
    training_settings,
)
from tendon_train.policy.runs.training_process import Process
from tendon_train.policy.worlds.environment import FingerEnvironment


@dataclass(frozen=True, kw_only=True)
class Trained:
    """A training that has come to its end."""

    environment: FingerEnvironment
    runner: Any  # rsl-rl's; it has the networks
    points: tuple[CurvePoint, ...]  # The learning curve


def train_policy(
    config: PolicyTrainingConfig,
    out: Path,
    *,
    report: Callable[[Progress], None],
    expect: Callable[[Forecast], None] | None = None,
    simulator: Any = None,
) -> Trained:
    """Train a policy, or go on where a checkpoint stopped.

    The worlds begin anew after each checkpoint, with draws that follow from the seed and the number
    of iterations. So an interrupted training that goes on is the same as one without a break.

    Args:
        report: Called after every iteration, in the first process.
        expect: Called in the first process before anything is compiled, with the size, and before
            the first iteration, with the time.
        simulator: Worlds of another program in place of ours, as for `FingerEnvironment`.
    """
    process = Process.own()
    device = process.device(config.device)
    torch.set_num_threads(config.threads)
    process.seed_draws(config.seed, 0)
    if expect is not None and process.rank == 0:
        worlds = config.environment.worlds
        steps = config.iterations * worlds * config.steps
        expect(Forecast(steps=steps, worlds=worlds, device=device))
    environment = FingerEnvironment(
        config.environment, seed=config.seed, device=device, simulator=simulator
    )
    runner = make_runner(environment, config, device)
    settings = training_settings(config, files_of(environment))
    points = load_checkpoint(out / "checkpoints", settings, runner.alg, device)
    first = process.rank == 0
    logger = CurveLogger(
        points,
        iterations=config.iterations,
        samples=config.environment.worlds * config.steps * process.count,
        report=report if first else lambda progress: None,
        folder=out / "tensorboard" if first else None,
    )
    runner.logger = logger
    left = config.iterations - len(logger.points)
    if expect is not None and first and left > 0:
        expect(timed(environment, left * config.environment.worlds * config.steps))
    try:
        while (done := len(logger.points)) < config.iterations:
            environment.reset(seed=process.seed_draws(config.seed, done))
            runner.alg.actor.distribution.forget()
            ahead = config.checkpoint_every - done % config.checkpoint_every
            for iteration in range(done, min(done + ahead, config.iterations)):
                learn_once(runner, config, iteration)
            if first:
                save_checkpoint(out / "checkpoints", settings, logger.points, runner.alg)
    finally:
        logger.close()
    return Trained(environment=environment, runner=runner, points=tuple(logger.points))


def learn_once(runner: Any, config: PolicyTrainingConfig, iteration: int) -> None:
    """Learn for one iteration, with its exploration and learning rate."""
    runner.current_learning_iteration = iteration
    explore(runner, exploration_at(config, iteration))
    if config.learning_rate_end is not None:
        learn_at(runner, learning_rate_at(config, iteration))
    runner.learn(1)


def make_runner(environment: FingerEnvironment, config: PolicyTrainingConfig, device: str) -> Any:
    """Return rsl-rl's runner with fresh networks."""
    # it imports GitPython, which must not demand that git is installed
    os.environ.setdefault("GIT_PYTHON_REFRESH", "quiet")
    from rsl_rl.runners import OnPolicyRunner

    with contextlib.redirect_stdout(io.StringIO()):  # it prints its networks
        return OnPolicyRunner(environment, to_rsl_rl(config), log_dir=None, device=device)


def explore(runner: Any, deviation: float) -> None:
    """Set the standard deviation of the network's outputs; no gradient reaches it."""
    runner.alg.actor.distribution.std_param.data.fill_(deviation)


def learn_at(runner: Any, rate: float) -> None:
    """Set the learning rate."""
    runner.alg.learning_rate = rate
    for group in runner.alg.optimizer.param_groups:
        group["lr"] = rate


def files_of(environment: FingerEnvironment) -> dict[str, str]:
    """Return the SHA-256 of every file that a training reads, by name."""
    layers = layers_of(environment.mechanism.asset)
    return {**{name: file_hash(p) for name, p in layers.items()}, **environment.force.files}
