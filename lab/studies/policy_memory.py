"""How much memory of a GPU a finger takes while a policy learns.

``python -m lab.studies.policy_memory FORCE... --worlds 8192 32768`` prints a line for each
force and number of worlds: what torch held at most, what Warp's pool held at most, and what the
whole device had more in use at the end than before the first tensor, contexts and kernels included.
"""

import argparse
import tempfile
from pathlib import Path

import torch
import warp as wp

from tendon_train.policy.config.environment_config import EnvironmentConfig
from tendon_train.policy.config.policy_training_config import PolicyTrainingConfig
from tendon_train.policy.runs.policy_training import train_policy

DEVICE = "cuda:0"


def main() -> None:
    """Train two iterations each and print what they took."""
    words = argparse.ArgumentParser(description=__doc__)
    words.add_argument("force", nargs="+")
    words.add_argument("--worlds", nargs="+", type=int, default=[8192, 32768])
    told = words.parse_args()
    wp.config.log_level = wp.LOG_ERROR
    free_before, _ = torch.cuda.mem_get_info(DEVICE)
    wp.set_mempool_release_threshold(DEVICE, 0)
    for force in told.force:
        for worlds in told.worlds:
            torch.cuda.empty_cache()
            torch.cuda.reset_peak_memory_stats(DEVICE)
            learn(force, worlds)
            torch_held = torch.cuda.max_memory_reserved(DEVICE)
            warp_held = wp.get_mempool_used_mem_high(DEVICE)
            free, _ = torch.cuda.mem_get_info(DEVICE)
            print(
                f"{Path(force).stem}, {worlds} worlds, 32 steps, 8 batches: torch "
                f"{torch_held / worlds / 1e3:.1f} kB a world, Warp's highest so far "
                f"{warp_held / worlds / 1e3:.1f} kB, device {(free_before - free) / 1e9:.2f} GB",
                flush=True,
            )


def learn(force: str, worlds: int) -> None:
    """Let a policy learn for two iterations."""
    config = PolicyTrainingConfig(
        environment=EnvironmentConfig(worlds=worlds, force=force, randomise=("none",)),
        iterations=2,
        steps=32,
        batch=worlds * 4,
        epochs=4,
        learning_rate=1.0e-3,
        device="cuda",
    )
    with tempfile.TemporaryDirectory() as folder:
        train_policy(config, Path(folder), report=lambda progress: None)


if __name__ == "__main__":
    main()
