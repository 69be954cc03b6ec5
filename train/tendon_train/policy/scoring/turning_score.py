"""Let a policy turn balls in simulation, and measure what the balls did."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import torch
from torch import Tensor

from tendon_newton.data.cards.policy_card import PolicyCard
from tendon_newton.data.turning_figures import TurningFigures, turning_figures
from tendon_train.policy.config.environment_config import EnvironmentConfig
from tendon_train.policy.worlds.environment import FingerEnvironment
from tendon_train.policy.worlds.turning import Turning

Actor = Callable[[Tensor], Tensor]
"""Gives actions [rad], shape (W, D), for observations, shape (W, N)."""
OBSERVED = "policy"
SPARE = 8.0  # Length of an episode in times that are watched: none ends by time, though ages differ


def turning_worlds(
    config: EnvironmentConfig, *, rate: float, seconds: float, seed: int, device: str = "cpu"
) -> FingerEnvironment:
    """Return hands that are asked for one rate and whose episodes end by drops alone.

    Args:
        rate: Commanded rate [rad/s].
        seconds: Time that they will be watched [s].
    """
    turning = replace(config.turning, turn_rates=(rate, rate))
    asked = replace(config, task="turn", turning=turning, episode=SPARE * seconds)
    return FingerEnvironment(asked, seed=seed, device=device)


def watch(environment: FingerEnvironment, actor: Actor, seconds: float) -> TurningFigures:
    """Let an actor turn balls; one that is dropped is put back.

    Args:
        seconds: Time to watch [s].
    """
    task = environment.task
    assert isinstance(task, Turning)
    seen, poses, tensions = environment.get_observations(), [], []
    for _ in range(max(1, round(seconds * environment.config.rate))):
        with torch.inference_mode():
            action = actor(seen[OBSERVED])
        seen, _, _, _ = environment.step(action.clone())
        poses.append(task.judged_pose.cpu().numpy().astype(np.float64))
        tensions.append(task.judged_tension.cpu().numpy().astype(np.float64))
    return turning_figures(
        task.card,
        period=1.0 / environment.config.rate,
        pose=np.array(poses),
        start=np.zeros(3),
        tension=np.array(tensions),
    )


def as_trained(card: PolicyCard, config: EnvironmentConfig) -> EnvironmentConfig:
    """Return an environment that shows and does what a policy's card says."""
    assert card.turning is not None
    no_rule = (card.command_range[0], card.command_range[1])
    return replace(
        config,
        task="turn",
        rate=card.rate,
        history=card.history,
        action_clip=card.action_clip,
        command_range=card.command_range,
        pay_out=card.pay_out or no_rule,
        turning=replace(config.turning, drop_distance=card.turning.drop_distance),
    )


def on_tensors(run: Callable[[Any], Any], servos: int) -> Actor:
    """Return what runs a policy's file on tensors of any device."""

    def act(seen: Tensor) -> Tensor:
        output = np.asarray(run(seen.cpu().numpy()), dtype=np.float32)
        return torch.from_numpy(output.reshape(-1, servos)).to(seen.device)

    return act
