"""A small environment and a short training, quick on one core."""

from typing import Any

import numpy as np
import torch

from tendon_train.policy.config.environment_config import EnvironmentConfig
from tendon_train.policy.config.policy_training_config import PolicyTrainingConfig
from tendon_train.policy.worlds.environment import FingerEnvironment

SMALL: dict[str, Any] = {
    "worlds": 6, "max_step": 2.0e-3, "randomise": (), "episode": 1.0, "goal_change": 0.1,
}  # fmt: skip


def environment(seed: int = 0, **changes: Any) -> FingerEnvironment:
    """Return six fingers whose episodes last a second."""
    return FingerEnvironment(EnvironmentConfig(**{**SMALL, **changes}), seed=seed)


def random_actions(count: int, worlds: int = 6, seed: int = 0) -> torch.Tensor:
    """Return offsets [rad], shape (count, W, 1), some of them beyond the clip."""
    generator = torch.Generator().manual_seed(seed)
    return 2.0 * torch.randn(count, worlds, 1, generator=generator)


def short_training(**changes: Any) -> PolicyTrainingConfig:
    """Return a training of a few updates, with every part in it."""
    own = {"iterations": 4, "steps": 8, "batch": 48, "epochs": 2, "checkpoint_every": 2}
    places = {k: changes.pop(k) for k in list(changes) if k in EnvironmentConfig.__annotations__}
    randomise = ("joint_friction", "link_mass", "spool_radius", "joint_spring")
    table = {**SMALL, "worlds": 12, "randomise": randomise, **places}
    return PolicyTrainingConfig(environment=EnvironmentConfig(**table), **{**own, **changes})


def stair_goals(count: int = 110) -> np.ndarray:
    """Return goals [rad] of 110 policy steps that rise and fall."""
    levels = np.pi / 10.0 * np.array([0, 1, 2, 3, 4, 5, 4, 3, 2, 1, 0])
    return np.repeat(levels, -(-count // levels.size))[:count]
