"""Policies for the fingers with routed strings, and how near they bring the tip to its goals.

``python -m lab.studies.other_fingers --out DIR`` trains each of three assets on the ideal
source for 307,200 steps, some minutes each on one core, and lets the policy climb stairs over its
path and back, in the nominal finger and in 15 others. What is finished is not done again;
``other_fingers.json`` and ``other_fingers.md`` have the figures.
"""

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np
import warp as wp

from tendon_hardware.control.policy_runner import load_policy
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_train.policy.config.environment_config import EnvironmentConfig
from tendon_train.policy.config.policy_training_config import PolicyTrainingConfig
from tendon_train.policy.runs.policy_export import export_policy
from tendon_train.policy.runs.policy_training import train_policy
from tendon_train.policy.scoring.evaluation_scores import score
from tendon_train.policy.scoring.policy_evaluation import (
    RunnablePolicy,
    climb_stairs,
    reachable_error,
)

GREATEST = {"finger_routed": 1.88, "finger_antagonist": 1.88, "thumb": 1.7, "hand": 1.88}
"""Greatest goal of each asset [rad]; the thumb's path ends at 1.78. A hand's tip is its index."""
LEVELS, DWELL = 6, 1.5  # stairs, s
OTHERS = 15


def main() -> None:
    """Train, climb, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--iterations", type=int, default=150)
    parser.add_argument("--fingers", nargs="+", default=list(GREATEST))
    words = parser.parse_args()
    wp.config.log_level = wp.LOG_ERROR
    table: dict[str, Any] = {"command": "python -m lab.studies.other_fingers"}
    lines = [
        "| asset | servos | tip error, first and last [mm] | stairs, RMS [mm] | settled [mm] "
        "| nearest [mm] | other fingers, median (worst) [mm] | diverged |",
        "|---|---|---|---|---|---|---|---|",
    ]
    print("\n".join(lines), flush=True)
    words.out.mkdir(parents=True, exist_ok=True)
    for name in words.fingers:
        table[name] = row = figures(name, words.iterations, words.out / name)
        worlds = row["world_rmse_m"]
        nearest = f"{1e3 * row['reachable_m']:.1f}" if row["reachable_m"] else "-"
        lines.append(
            f"| `{name}` | {row['servos']} | {1e3 * row['first_m']:.1f}, {1e3 * row['last_m']:.1f} "
            f"| {1e3 * row['rmse_m']:.1f} | {1e3 * row['settled_m']:.1f} "
            f"| {nearest} | {1e3 * float(np.median(worlds)):.1f} ({1e3 * max(worlds):.1f}) "
            f"| {row['diverged']} |"
        )
        print(lines[-1], flush=True)
        (words.out / "other_fingers.json").write_text(json.dumps(table, indent=1) + "\n")
        (words.out / "other_fingers.md").write_text("\n".join(lines) + "\n")


def training(name: str, iterations: int) -> PolicyTrainingConfig:
    """Return a training of some minutes."""
    return PolicyTrainingConfig(
        environment=EnvironmentConfig(
            finger=name, worlds=64, goals=(0.0, GREATEST[name]), goal_change=0.02, max_step=2.0e-3
        ),
        iterations=iterations,
        steps=32,
        epochs=4,
        learning_rate=1.0e-3,
        discount=0.8,
        trace=0.9,
        exploration=0.3,
        checkpoint_every=50,
    )


def figures(name: str, iterations: int, folder: Path) -> dict[str, Any]:
    """Train one asset's policy, let it climb, and return what came of it."""
    folder.mkdir(exist_ok=True)
    config = training(name, iterations)
    trained = train_policy(config, folder, report=lambda progress: None)
    policy = load_policy(export_policy(folder, trained, config).onnx)
    top = GREATEST[name]
    levels = np.concatenate([np.linspace(0.0, top, LEVELS), np.linspace(top, 0.0, LEVELS)[1:]])
    goals = np.repeat(levels, round(DWELL * config.environment.rate))
    runnable = RunnablePolicy(name=name, card=policy.card, run=policy.run)
    worlds = EnvironmentConfig(finger=name, worlds=1 + OTHERS)
    (climb,) = climb_stairs([runnable], goals, worlds)
    reachable = reachable_error(load_mechanism(name), goals)
    found = score(climb, reachable)
    errors = [point.tip_error for point in trained.points]
    return {
        "servos": policy.card.servo_count,
        "steps": trained.points[-1].samples,
        "first_m": float(np.mean(errors[:3])),
        "last_m": float(np.mean(errors[-10:])),
        "rmse_m": found.rmse,
        "settled_m": found.settled_error,
        "reachable_m": float(np.mean(reachable)),
        "world_rmse_m": list(found.world_rmse),
        "diverged": sum(point.diverged for point in trained.points),
    }


if __name__ == "__main__":
    main()
