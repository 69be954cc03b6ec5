"""Train several seeds of a hand side by side, each with its own hands of one simulation.

``python -m lab.studies.turning_seeds --out DIR`` writes a policy and a learning curve of each
seed, and does so every ten iterations. A GPU steps ten thousand hands in little more time than two
thousand, so that ten seeds take twice the time of one. Two runs that differ in ``--force`` alone
are pairs: a seed has the same starting weights and draws in both.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import torch
from rsl_rl.algorithms import PPO
from tensordict import TensorDict

from tendon_newton.data.files.json_file import write_json
from tendon_newton.data.files.origin import git_commit
from tendon_newton.device_code.quiet import quiet_warp
from tendon_train.policy.config.environment_config import EnvironmentConfig
from tendon_train.policy.config.policy_training_config import (
    PolicyTrainingConfig,
    exploration_at,
    learning_rate_at,
    to_rsl_rl,
)
from tendon_train.policy.config.turning_config import TurningConfig
from tendon_train.policy.runs.policy_export import PolicyNetwork, make_card, write_policy_onnx
from tendon_train.policy.runs.policy_training import explore, learn_at
from tendon_train.policy.worlds.environment import FingerEnvironment
from tendon_train.policy.worlds.turning import Turning

RANDOMISE = (
    "joint_friction", "link_mass", "spool_radius", "joint_spring", "coulomb_friction",
    "gear_load_friction", "routing_friction",
)  # fmt: skip
RECIPE = PolicyTrainingConfig(
    steps=16, batch=4096, epochs=5, iterations=80, discount=0.97, hidden=(256, 128, 64),
    exploration=7.0, exploration_end=0.7, exploration_memory=0.8,
    learning_rate=1.0e-3, learning_rate_end=2.0e-4,
    environment=EnvironmentConfig(
        task="turn", force="lab/studies/turning_models/stretching.toml", randomise=RANDOMISE,
        worlds=1024, max_step=1.0e-3, history=8, episode=10.0, smooth_weight=0.003, action_clip=9.0,
        action_unit=9.0,
    ),
)  # fmt: skip
KEPT_EVERY = 10  # Iterations from one writing of the policies to the next
COLUMNS = ("iteration", "seconds", "turning_rad_per_s", "reward")


@dataclass(kw_only=True)
class Learner:
    """A seed's training."""

    config: PolicyTrainingConfig
    alg: PPO
    share: slice  # Its worlds among those of the simulation
    rows: list[list[float]] = field(default_factory=list)  # Learning curve: `COLUMNS`

    def part(self, seen: TensorDict) -> TensorDict:
        """Return what its own hands see."""
        return seen[self.share]


def main() -> None:
    """Train, and write what came of it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--seeds", type=int, nargs="+", default=list(range(10)))
    parser.add_argument("--finger", default=RECIPE.environment.finger, help="hand, as an asset")
    parser.add_argument("--force", default=RECIPE.environment.force, help="model of the servo")
    parser.add_argument("--randomise", nargs="+", default=RANDOMISE, help="as of train-policy")
    parser.add_argument("--worlds", type=int, default=RECIPE.environment.worlds, help="of a seed")
    parser.add_argument("--iterations", type=int, default=RECIPE.iterations)
    parser.add_argument("--stop-after", type=int, help="iterations; by default all of them")
    parser.add_argument("--rate-window", type=float, default=TurningConfig.rate_window, help="[s]")
    parser.add_argument("--catch-up-time", type=float, default=TurningConfig.catch_up_time)
    parser.add_argument("--history", type=int, default=RECIPE.environment.history)
    parser.add_argument("--device", default="cuda")
    words = parser.parse_args()
    quiet_warp()
    turning = replace(
        RECIPE.environment.turning, rate_window=words.rate_window, catch_up_time=words.catch_up_time
    )
    own = replace(
        RECIPE.environment,
        finger=words.finger,
        force=words.force,
        randomise=tuple(words.randomise),
        worlds=words.worlds,
        turning=turning,
        history=words.history,
    )
    config = replace(RECIPE, environment=own, iterations=words.iterations, device=words.device)
    words.out.mkdir(parents=True, exist_ok=True)
    train(config, words.seeds, words.stop_after or words.iterations, words.out)


def train(config: PolicyTrainingConfig, seeds: list[int], last: int, out: Path) -> None:
    """Train all seeds, and write what each has learned.

    Args:
        last: Iteration after which all end; exploration and learning rate fall until the config's.
    """
    worlds, begun = config.environment.worlds, time.monotonic()
    together = replace(config.environment, worlds=worlds * len(seeds))
    environment = FingerEnvironment(together, seed=seeds[0], device=config.device)
    assert isinstance(environment.task, Turning)
    seen = environment.get_observations()
    learners = [
        learner_of(replace(config, seed=seed), environment, slice(k * worlds, (k + 1) * worlds))
        for k, seed in enumerate(seeds)
    ]
    for iteration in range(last):
        for learner in learners:
            explore(learner, exploration_at(config, iteration))
            learn_at(learner, learning_rate_at(config, iteration))
        paid = torch.zeros(environment.num_envs, device=environment.device)
        with torch.inference_mode():
            for _ in range(config.steps):
                actions = torch.cat([each.alg.act(each.part(seen)) for each in learners])
                seen, reward, dones, extras = environment.step(actions)
                paid += reward / config.steps
                for each in learners:
                    late = {"time_outs": extras["time_outs"][each.share]}
                    own = reward[each.share], dones[each.share], late
                    each.alg.process_env_step(each.part(seen), *own)
            for each in learners:
                each.alg.compute_returns(each.part(seen))
        seconds = time.monotonic() - begun
        for each in learners:
            each.alg.update()
            rate = float(environment.task.rate[each.share].mean())
            each.rows.append([iteration + 1, seconds, rate, float(paid[each.share].mean())])
        rates = ", ".join(f"{each.rows[-1][2]:.2f}" for each in learners)
        print(f"iteration {iteration + 1}, {seconds:.0f} s: {rates} rad/s", flush=True)
        if (iteration + 1) % KEPT_EVERY == 0 or iteration + 1 == last:
            write(out, environment, learners)


def write(out: Path, environment: FingerEnvironment, learners: list[Learner]) -> None:
    """Write policies and learning curves."""
    for learner in learners:
        unit = environment.config.action_unit
        network = PolicyNetwork(learner.alg.get_policy(), unit).eval()
        draft = out / f"seed_{learner.config.seed}.draft"
        write_policy_onnx(draft, network, make_card(environment, learner.config, ()))
        draft.replace(draft.with_suffix(".onnx"))
    curves = {str(learner.config.seed): learner.rows for learner in learners}
    table = {"commit": git_commit(), "columns": COLUMNS, "seeds": curves}
    write_json(out / "curves.json", table)


def learner_of(
    config: PolicyTrainingConfig, environment: FingerEnvironment, share: slice
) -> Learner:
    """Return a seed's fresh networks and its hands."""
    torch.manual_seed(config.seed)
    own: Any = SimpleNamespace(
        num_envs=config.environment.worlds,
        num_actions=environment.num_actions,
        cfg=environment.config,
        max_episode_length=environment.max_episode_length,
        device=environment.device,
    )
    table = {**to_rsl_rl(config), "multi_gpu": None}
    seen = environment.get_observations()[share]
    alg = PPO.construct_algorithm(seen, own, table, str(environment.device))
    alg.train_mode()
    return Learner(config=config, alg=alg, share=share)


if __name__ == "__main__":
    main()
