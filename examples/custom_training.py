"""A training loop of your own: evolution in place of PPO, and every world tries another policy.

A policy here is four numbers: a constant, and what goal, motor angle and motor speed count for.
"""

import sys

import torch

from tendon_train.policy.config.environment_config import EnvironmentConfig
from tendon_train.policy.worlds.environment import FingerEnvironment


def train(
    worlds: int = 256, generations: int = 15, steps: int = 200
) -> tuple[torch.Tensor, list[float]]:
    """Return the best policy (4,), and the mean reward of a step in each generation."""
    config = EnvironmentConfig(worlds=worlds, goal_change=0.05, max_step=2.0e-3)
    environment = FingerEnvironment(config, seed=0)
    generator = torch.Generator().manual_seed(0)
    mean, spread = torch.zeros(4), torch.ones(4)
    curve = []
    for _ in range(generations):
        candidates = mean + spread * torch.randn(worlds, 4, generator=generator)
        observation, reward = environment.reset()["policy"], torch.zeros(worlds)
        for _ in range(steps):
            theta, speed, _, _, goal = observation[:, -5:].unbind(dim=1)
            features = torch.stack([torch.ones_like(theta), goal, theta, speed], dim=1)
            action = (candidates * features).sum(dim=1, keepdim=True)
            seen, step_reward, _, _ = environment.step(action)
            observation, reward = seen["policy"], reward + step_reward / steps
        best = candidates[reward.topk(worlds // 8).indices]
        mean, spread = best.mean(dim=0), best.std(dim=0) + 0.01
        curve.append(float(reward.mean()))
    return mean, curve


if __name__ == "__main__":
    policy, rewards = train()
    sys.stdout.write(f"reward {rewards[0]:.3f} -> {rewards[-1]:.3f} with {policy.tolist()}\n")
