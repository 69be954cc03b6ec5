"""The state of a training on disk, so that an interrupted one goes on."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from tendon_newton.errors import InvalidPolicyFile
from tendon_train.checkpoint_file import read_checkpoint, write_checkpoint
from tendon_train.policy.config.policy_training_config import PolicyTrainingConfig
from tendon_train.policy.runs.curve import CurvePoint, curve_table, read_curve

FREE_KEYS = ("iterations", "checkpoint_every", "device", "threads")
"""Settings that may change when a training goes on."""


def training_settings(config: PolicyTrainingConfig, files: Mapping[str, str]) -> dict[str, Any]:
    """Return all that decides a training: its config and a hash of each file that it reads."""
    table = asdict(config)
    kept = {key: value for key, value in table.items() if key not in FREE_KEYS}
    own = kept.pop("environment")
    return json.loads(json.dumps({**kept, **own, **files}))


def save_checkpoint(
    folder: Path, settings: Mapping[str, Any], points: Sequence[CurvePoint], algorithm: Any
) -> None:
    """Write a checkpoint; a process that is killed leaves it whole or not at all."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{len(points):06d}.pt"
    write_checkpoint(path, settings, curve=curve_table(points), algorithm=algorithm.save())


def load_checkpoint(
    folder: Path, settings: Mapping[str, Any], algorithm: Any, device: str
) -> list[CurvePoint]:
    """Bring a training to where its last checkpoint stopped; without one, to its start.

    Args:
        settings: Settings of the training; the checkpoint must have been written under the same.
        algorithm: rsl-rl's; it gets the weights and the optimiser's state.

    Returns:
        The learning curve up to there.

    Raises:
        InvalidPolicyFile: The checkpoint is damaged, or belongs to another training.
    """
    files = sorted(folder.glob("[0-9]*.pt"))
    if not files:
        return []
    remedy = "go on from the one before"
    with read_checkpoint(files[-1], settings, device, InvalidPolicyFile, remedy) as table:
        algorithm.load(table["algorithm"], None, True)
        points = read_curve(table["curve"])
    return points
