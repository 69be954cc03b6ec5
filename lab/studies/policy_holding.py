"""Policies that meet a ball in their way: whether they press on, hold still, and let go.

``python -m lab.studies.policy_holding --out DIR`` trains two policies on the ideal source,
with a ball in the way of half of the episodes and without, 276,480 steps each, some minutes on one
core; ``--device cuda --worlds 4096 --seeds 0 1 2`` has 8.8 million steps each and three of both.
Then 64 fingers with balls that none has seen are asked for the closed finger for 4 s, and for the
open one for 2 s, and 64 without a ball go to three goals for 2 s each. What is trained is not
trained again; ``holding.md`` has the table.
"""

import argparse
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import torch
import warp as wp
from tensordict import TensorDict

from tendon_newton.data.recording import Array
from tendon_train.policy.config.environment_config import EnvironmentConfig
from tendon_train.policy.config.policy_training_config import PolicyTrainingConfig
from tendon_train.policy.runs.policy_training import train_policy
from tendon_train.policy.worlds.environment import FingerEnvironment
from tendon_train.policy.worlds.tip_goal import TipGoal

CLOSED, OPEN = 1.8, 0.1  # rad, goals behind the ball and before it
HOLD, RELEASE, LATE = 80, 40, 40  # policy steps of 50 ms: 4 s, 2 s, and the last 2 s of the hold
FREE = (0.6, 1.2, 1.8)  # rad, 2 s each, of which the second counts
TOUCH = 0.05  # N
SEED = 77  # of the balls
FINGERS = EnvironmentConfig(worlds=128, randomise=("none",), obstacle="sphere", goal_change=0.03)
Policy = Callable[[TensorDict], torch.Tensor]


def main() -> None:
    """Train, hold and write the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--iterations", type=int, default=90)
    parser.add_argument("--worlds", type=int, default=128)
    parser.add_argument("--seeds", type=int, nargs="+", default=[0])
    parser.add_argument("--device", choices=("cpu", "cuda"), default="cpu")
    words = parser.parse_args()
    wp.config.log_level = wp.LOG_ERROR
    lines = [
        "| trained with | seed | fingers that press at the end | force, median (range) [N] "
        "| standard deviation in 2 s | let go within 2 s | tip error with nothing in the way |",
        "|---|---|---|---|---|---|---|",
    ]
    for seed in words.seeds:
        for name, chance in (("a ball in half of the episodes", 0.5), ("nothing in the way", 0.0)):
            policy = learn(chance, seed, words)
            lines.append(row(f"{name} | {seed}", policy, words.device))
    (words.out / "holding.md").write_text("\n".join(lines) + "\n", encoding="utf-8")
    print("\n".join(lines))


def learn(chance: float, seed: int, words: argparse.Namespace) -> Policy:
    """Train a policy with a ball in the way of a share of the episodes."""
    config = PolicyTrainingConfig(
        environment=replace(FINGERS, obstacle_chance=chance, worlds=words.worlds),
        seed=seed,
        device=words.device,
        iterations=words.iterations,
        steps=24,
        batch=6 * words.worlds,
        epochs=4,
        learning_rate=1e-3,
        learning_rate_end=2.0e-4,
        discount=0.8,
        trace=0.9,
        exploration=0.4,
        exploration_end=0.2,
        checkpoint_every=20,
    )
    folder = words.out / f"chance_{chance}_seed_{seed}"
    folder.mkdir(parents=True, exist_ok=True)
    trained = train_policy(config, folder, report=lambda progress: None)
    return trained.runner.get_inference_policy()


def run(policy: Policy, chance: float, goals: list[float], device: str) -> tuple[Array, Array]:
    """Let a policy go through goals, one a step, from the open finger.

    Returns:
        Force on each finger [N] and error of its tip [m], shape (T, W) each.
    """
    config = replace(FINGERS, worlds=64, obstacle_chance=chance, goal_change=0.0, episode=1000.0)
    finger = FingerEnvironment(config, seed=SEED, device=device)
    still = torch.zeros(64, 1, device=device)
    finger.loop.reset(still)
    finger.history.reset(torch.ones(64, dtype=torch.bool, device=device))
    seen = finger.step(still)[0]
    forces, errors = [], []
    for goal in goals:
        finger.goal.fill_(goal)
        with torch.inference_mode():
            action = policy(seen)
        seen = finger.step(action.clone())[0]
        contact = finger.loop.contact_forces().sum(dim=(1, 2))
        forces.append(torch.linalg.vector_norm(contact, dim=-1).cpu().numpy().copy())
        assert isinstance(finger.task, TipGoal)
        errors.append(finger.task.tip_error().cpu().numpy().copy())
    return np.array(forces), np.array(errors)


def row(name: str, policy: Policy, device: str) -> str:
    """Let a policy hold and move, and return its row."""
    force, _ = run(policy, 1.0, [CLOSED] * HOLD + [OPEN] * RELEASE, device)
    _, error = run(policy, 0.0, [goal for goal in FREE for _ in range(LATE)], device)
    settled = error.reshape(len(FREE), LATE, -1)[:, LATE // 2 :].mean()
    late = force[HOLD - LATE : HOLD]
    pressing = late.min(axis=0) > TOUCH
    if not pressing.any():
        return f"| {name} | 0 of {force.shape[1]} | | | | {1e3 * settled:.1f} mm |"
    held = late[:, pressing]
    level = np.median(held, axis=0)
    ripple = np.median(held.std(axis=0) / held.mean(axis=0))
    free = (force[-1] < TOUCH)[pressing]
    return (
        f"| {name} | {pressing.sum()} of {force.shape[1]} | {np.median(level):.2f} "
        f"({level.min():.2f} to {level.max():.2f}) | {100.0 * ripple:.1f} % "
        f"| {free.sum()} of {free.size} | {1e3 * settled:.1f} mm |"
    )


if __name__ == "__main__":
    main()
