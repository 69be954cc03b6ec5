"""The state of a training on disk, so that an interrupted one goes on."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from io import BytesIO
from pathlib import Path
from typing import Any

import torch

from tendon_newton.data.files.text_file import write_bytes
from tendon_newton.errors import InvalidPolicyFile
from tendon_train.policy.config.policy_training_config import PolicyTrainingConfig
from tendon_train.policy.runs.curve import CurvePoint, curve_table, read_curve

FREE_KEYS = ("iterations", "checkpoint_every", "device", "threads")
"""Settings that may change when a training goes on."""


def training_settings(config: PolicyTrainingConfig, files: Mapping[str, str]) -> dict[str, Any]:
    """Return all that decides a training: its config and a hash of each file that it reads."""
    table = asdict(config)
    kept = {key: value for key, value in table.items() if key not in FREE_KEYS}
    own = kept.pop("environment")
    return json.loads(json.dumps({**kept, **own, "files": dict(files)}))


def save_checkpoint(
    folder: Path, settings: Mapping[str, Any], points: Sequence[CurvePoint], algorithm: Any
) -> None:
    """Write a checkpoint; a process that is killed leaves it whole or not at all."""
    table = {
        "settings": dict(settings),
        "curve": curve_table(points),
        "algorithm": algorithm.save(),
    }
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{len(points):06d}.pt"
    content = BytesIO()  # torch tells of a full disk by an error of its own
    torch.save(table, content)
    write_bytes(path, content.getvalue())


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
    path = files[-1]
    try:
        # weights_only: a checkpoint can hold numbers and names, and no code
        table = torch.load(path, map_location=device, weights_only=True)
        refuse_other_settings(path, table["settings"], settings)
        algorithm.load(table["algorithm"], None, True)
        return read_curve(table["curve"])
    except InvalidPolicyFile:
        raise
    except Exception as error:  # torch's reader of damaged bytes fails in any way
        raise InvalidPolicyFile(
            f"{path}: the checkpoint of a training is damaged or of another version "
            f"({type(error).__name__}); delete it to go on from the one before"
        ) from error


def refuse_other_settings(
    path: Path, saved: Mapping[str, Any], settings: Mapping[str, Any]
) -> None:
    """Refuse to go on with other settings than the training began with."""
    for key, value in settings.items():
        if saved.get(key) != value:
            raise InvalidPolicyFile(
                f"{path}: this training began with {key} = {saved.get(key)!r}, and now it is "
                f"{value!r}; use another folder"
            )
