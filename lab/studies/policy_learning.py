"""How fast a policy learns on a CPU, by how far its rewards reach and by its seed.

``python -m lab.studies.policy_learning --out DIR`` trains 128 fingers with random numbers on
the ideal source for 184,320 steps and prints the tip error of the last ten iterations, while
exploring. What is finished is not done again; ``learning.md`` has the table.
"""

import argparse
from pathlib import Path

import numpy as np
import warp as wp

from tendon_train.policy.config.environment_config import EnvironmentConfig
from tendon_train.policy.config.policy_training_config import PolicyTrainingConfig
from tendon_train.policy.runs.policy_training import train_policy

HORIZONS = ((0.95, 0.95), (0.8, 0.9))  # discount and trace: the authors', and the finger's own
LAST = 10  # iterations


def main() -> None:
    """Train and write the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--seeds", type=int, nargs="+", default=[0, 1, 2])
    words = parser.parse_args()
    wp.config.log_level = wp.LOG_ERROR
    lines = ["| discount | trace | seed | tip error [mm] |", "|---|---|---|---|"]
    print("\n".join(lines), flush=True)
    for discount, trace in HORIZONS:
        for seed in words.seeds:
            folder = words.out / f"discount_{discount}_seed_{seed}"
            folder.mkdir(parents=True, exist_ok=True)
            error = last_error(training(discount, trace, seed), folder)
            lines.append(f"| {discount} | {trace} | {seed} | {1e3 * error:.1f} |")
            print(lines[-1], flush=True)
    (words.out / "learning.md").write_text("\n".join(lines) + "\n", encoding="utf-8")


def training(discount: float, trace: float, seed: int) -> PolicyTrainingConfig:
    """Return a training of about ten seconds."""
    return PolicyTrainingConfig(
        environment=EnvironmentConfig(worlds=128, max_step=2.0e-3),
        iterations=60,
        steps=24,
        batch=768,
        epochs=4,
        learning_rate=1.0e-3,
        discount=discount,
        trace=trace,
        exploration=0.4,
        seed=seed,
        checkpoint_every=20,
    )


def last_error(config: PolicyTrainingConfig, folder: Path) -> float:
    """Train and return the mean tip error of the last iterations [m]."""
    points = train_policy(config, folder, report=lambda progress: None).points
    return float(np.mean([point.tip_error for point in points[-LAST:]]))


if __name__ == "__main__":
    main()
