"""Settings of the training of a policy."""

from dataclasses import dataclass, field
from typing import Any

import tyro

from tendon_newton.errors import require
from tendon_train.policy.config.environment_config import EnvironmentConfig

OBSERVED = "policy"  # Name of the observations among those that the environment offers.
HIDDEN = "hidden"  # Name of what only the critic sees.
POSITIVE = (
    "iterations",
    "steps",
    "batch",
    "epochs",
    "learning_rate",
    "clip",
    "exploration",
    "checkpoint_every",
    "threads",
)


@dataclass(frozen=True, kw_only=True)
class PolicyTrainingConfig:
    """How a policy is trained: PPO; its numbers are those of the paper's authors."""

    environment: tyro.conf.OmitArgPrefixes[EnvironmentConfig] = field(
        default_factory=EnvironmentConfig
    )
    seed: int = 0  # Seed of the starting weights and of all draws.
    iterations: int = 200
    """Rounds of acting and learning; more of them go on with a finished training."""
    steps: int = 128  # Policy steps of every world in an iteration.
    batch: int = 1024  # Steps that one update of the weights learns from, at most.
    epochs: int = 1  # Times that an iteration learns from each step.
    learning_rate: float = 5.0e-4  # Learning rate of Adam.
    learning_rate_end: float | None = None
    """Last learning rate, reached evenly from iteration to iteration; none keeps it. The less a
    policy explores, the more a change of its weights does to the probability of an action."""
    clip: float = 0.2  # Most that an update may change the probability of an action, as a share.
    discount: float = 0.95  # Worth of a reward one step earlier [1].
    trace: float = 0.95
    """Weight of later steps in an advantage, before the critic's part (the lambda of GAE) [1]."""
    exploration: float = 0.7
    """Standard deviation of the actions in training [rad]; it is given, and not learned. Less than
    what breaks a gear's friction loose hardly moves a finger, and teaches nothing."""
    exploration_end: float | None = None
    """Last exploration [rad], reached evenly from iteration to iteration, so that the policy gets
    precise at last; none keeps it."""
    exploration_memory: float = 0.0
    """Share of a step's noise that the next step keeps [1]. What takes several steps, such as a
    finger's stroke, is hardly ever found by noise that is new in each."""
    hidden: tuple[int, ...] = (128, 64, 32)
    """Widths of the layers of actor and critic, with ReLU between them."""
    checkpoint_every: int = 10  # Iterations from one checkpoint to the next.
    device: str = "auto"  # cpu, cuda, or auto: a GPU where torch finds one.
    threads: int = 1  # Threads of torch on the CPU.

    def __post_init__(self) -> None:
        require(self, "be positive", lambda x: 0 < x < 1.0e9, POSITIVE)
        require(self, "be between 0 and 1", lambda x: 0.0 <= x <= 1.0, ("discount", "trace"))
        below = "be from 0 to below 1"
        require(self, below, lambda x: 0.0 <= x < 1.0, ["exploration_memory"])
        ends = ("exploration_end", "learning_rate_end")
        require(self, "be positive", lambda x: x is None or 0.0 < x < 1.0e9, ends)
        require(self, "not be negative", lambda x: x >= 0, ["seed"])
        require(self, "be widths of layers", lambda x: len(x) > 0 and min(x) >= 1, ["hidden"])

    @property
    def batch_count(self) -> int:
        """Updates of the weights per epoch."""
        steps = self.environment.worlds * self.steps
        return max(1, -(-steps // self.batch))


def exploration_at(config: PolicyTrainingConfig, done: int) -> float:
    """Return the standard deviation of a network's outputs after so many iterations."""
    deviation = on_the_way(config.exploration, config.exploration_end, done / config.iterations)
    return deviation / config.environment.action_unit


def learning_rate_at(config: PolicyTrainingConfig, done: int) -> float:
    """Return the learning rate after so many iterations."""
    return on_the_way(config.learning_rate, config.learning_rate_end, done / config.iterations)


def on_the_way(start: float, end: float | None, share: float) -> float:
    """Return what has come of a number after a share of the training, if it moves at all."""
    return start if end is None else start + share * (end - start)


def to_rsl_rl(config: PolicyTrainingConfig) -> dict[str, Any]:
    """Return the table that rsl-rl wants."""
    network = {
        "class_name": "MLPModel",
        "hidden_dims": list(config.hidden),
        "activation": "relu",
        "obs_normalization": True,
    }
    actions = {
        "class_name": "tendon_train.policy.runs.kept_noise:KeptNoise",
        "memory": config.exploration_memory,
        "init_std": exploration_at(config, 0),
        "learn_std": False,
    }
    critic = [OBSERVED] if config.environment.task == "tip" else [OBSERVED, HIDDEN]
    return {
        "num_steps_per_env": config.steps,
        "save_interval": config.iterations,
        "check_for_nan": True,
        "obs_groups": {"actor": [OBSERVED], "critic": critic},
        "actor": {**network, "distribution_cfg": actions},
        "critic": dict(network),
        "algorithm": {
            "class_name": "PPO",
            "num_learning_epochs": config.epochs,
            "num_mini_batches": config.batch_count,
            "learning_rate": config.learning_rate,
            "schedule": "fixed",  # `learning_rate_at` says how it falls
            "clip_param": config.clip,
            "gamma": config.discount,
            "lam": config.trace,
            "entropy_coef": 0.0,  # the entropy of a given deviation is constant
            "use_clipped_value_loss": False,  # returns are not of the size 1 that its clip suits
            "max_grad_norm": 1.0,
        },
    }
