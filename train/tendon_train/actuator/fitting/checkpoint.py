"""The state of a training on disk, so that an interrupted one goes on as if it had not been."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor

from tendon_newton.errors import InvalidNetworkFile
from tendon_newton.force_networks.force_network import ForceNetwork
from tendon_train.actuator.fitting.descent import Descent
from tendon_train.actuator.samples.windows import Windows
from tendon_train.actuator.training_config import TrainingConfig
from tendon_train.checkpoint_file import read_checkpoint, write_checkpoint

RECIPE = 1
"""Number of the recipe: how windows are changed, errors weighed and weights moved, which no config
says. Whoever changes that raises it; a test knows the numbers that belong to this one."""
FREE_KEYS = ("device", "threads", "patience", "force_limit")
"""Settings that may change when a training goes on."""
TOLERANCE = 1.15
"""Ratio up to which validation errors count as the same [1]. A handful of recordings cannot tell
them apart: seven were 11 % wrong about which of two trainings does better on 49 others. The later
of two such epochs, at the lower learning rate, is the better bet."""

Weights = dict[str, Tensor]


@dataclass(frozen=True, kw_only=True)
class Checkpoint:
    """Weights, errors and random state of a training so far."""

    epoch: int = 0  # Number of finished epochs
    best_error: float = float("inf")  # Lowest mean absolute validation error [N]
    kept_epoch: int = 0  # Latest epoch as good as the lowest error, to within ``TOLERANCE``
    kept_weights: Weights  # Weights and normalisation of that epoch
    # After each epoch: RMS error on the fitted windows, and on the validation windows the mean
    # absolute error [N]
    history: tuple[tuple[float, float], ...] = ()

    def finished(self, config: TrainingConfig) -> bool:
        """Say whether all epochs are done or the last ones brought nothing."""
        return self.epoch >= config.epochs or self.epoch - self.kept_epoch >= config.patience

    def after_epoch(self, error: float, train_error: float, network: ForceNetwork) -> Checkpoint:
        """Return where the training stands after one more epoch."""
        done = replace(self, epoch=self.epoch + 1, history=(*self.history, (train_error, error)))
        done = replace(done, best_error=min(error, self.best_error))
        if error > TOLERANCE * done.best_error:
            return done
        weights = {
            name: value.detach().cpu().clone() for name, value in network.state_dict().items()
        }
        return replace(done, kept_epoch=done.epoch, kept_weights=weights)


@dataclass(frozen=True, kw_only=True)
class TrainingState:
    """Network, descent and draws, which change in a training."""

    network: ForceNetwork
    descent: Descent
    generator: torch.Generator  # Draws the windows and what disturbs them

    @staticmethod
    def start(network: ForceNetwork, config: TrainingConfig) -> TrainingState:
        """Return the state before the first epoch."""
        return TrainingState(
            network=network,
            descent=Descent(network, config.learning_rate),
            generator=torch.Generator().manual_seed(config.seed),
        )


def save_checkpoint(
    path: Path, settings: Mapping[str, Any], state: TrainingState, done: Checkpoint
) -> None:
    """Write a checkpoint; a process that is killed leaves the old one or the new one."""
    write_checkpoint(
        path,
        settings,
        done=vars(done),
        network=state.network.state_dict(),
        descent=state.descent.state_dict(),
        generator=state.generator.get_state(),
        random=torch.get_rng_state(),  # dropout draws from it
    )


def load_checkpoint(path: Path, settings: Mapping[str, Any], state: TrainingState) -> Checkpoint:
    """Bring a training to where its checkpoint stopped; without one, to its start.

    Args:
        settings: Settings of the training; the checkpoint must have been written under the same.

    Raises:
        InvalidNetworkFile: The file is damaged or belongs to another training.
    """
    if not path.is_file():
        return Checkpoint(kept_weights={})
    device = state.network.force_mean.device
    with read_checkpoint(path, settings, device, InvalidNetworkFile, "start again") as table:
        state.network.load_state_dict(table["network"])
        state.descent.load_state_dict(table["descent"])
        state.generator.set_state(table["generator"].cpu())
        torch.set_rng_state(table["random"].cpu())
        done = table["done"]
        found = Checkpoint(**done | {"history": tuple(map(tuple, done["history"]))})
    return found


def training_settings(config: TrainingConfig, *data: Windows) -> dict[str, Any]:
    """Return all that decides a training: its recipe, its config and a hash of its data."""
    digest = hashlib.sha256()
    for windows in data:
        for values in (windows.inputs, windows.force, windows.rows):
            digest.update(np.ascontiguousarray(values).tobytes())
    kept = {key: value for key, value in asdict(config).items() if key not in FREE_KEYS}
    return {"recipe": RECIPE} | kept | {"data": digest.hexdigest()}
