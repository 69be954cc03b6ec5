"""Train a force network: mean squared error, one cycle, watched by whole held-out recordings.

Held-out error is the mean absolute one. Where a motor sticks for longer than a window, nothing in
the window tells the force. A few such seconds would decide a mean square, and stop a training that
still gets better everywhere else.
"""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import torch

from tendon_newton.errors import InvalidParameter
from tendon_newton.force_networks import build_network
from tendon_newton.force_networks.force_network import ForceNetwork
from tendon_train.actuator.fitting.checkpoint import (
    Checkpoint,
    TrainingState,
    load_checkpoint,
    save_checkpoint,
    training_settings,
)
from tendon_train.actuator.samples.changed_windows import changed_batch
from tendon_train.actuator.samples.servo_law import ServoLaw, fit_servo_law
from tendon_train.actuator.samples.windows import Windows, WindowTensors, to_device
from tendon_train.actuator.training_config import TrainingConfig

VALIDATION_STRIDE = 4  # One window in so many tells when to stop: at 80 Hz, one of the four phases
VALIDATION_BATCH = 8192


@dataclass(frozen=True, kw_only=True)
class FittingProgress:
    """Figures of a training after an epoch."""

    epoch: int  # Number of finished epochs
    epochs: int  # Greatest number of epochs
    train_rmse: float  # Over the epoch's windows, while the weights changed [N]
    validation_error: float  # Mean absolute error on held-out train recordings [N]
    best_error: float  # Lowest validation error so far [N]
    seconds_left: float  # At this pace, if nothing stops the training early [s]


def train_network(
    config: TrainingConfig,
    fit: Windows,
    validation: Windows,
    checkpoint: Path,
    *,
    law: ServoLaw | None = None,
    report: Callable[[FittingProgress], None] = lambda progress: None,
) -> tuple[ForceNetwork, Checkpoint]:
    """Train a network, or go on where a checkpoint stopped.

    Args:
        fit: Windows that give gradients.
        validation: Windows of other recordings, that say when to stop.
        checkpoint: Written after every epoch.
        law: How the servo answers to its shaft; by default what the fitted windows say of it.

    Returns:
        The network with the weights that were kept, on the CPU, and the last checkpoint.

    Raises:
        InvalidParameter: The device is not there, or the network's numbers left all bounds.
        InvalidNetworkFile: The checkpoint is damaged or belongs to another training.
    """
    if config.device.startswith("cuda") and not torch.cuda.is_available():
        raise InvalidParameter("device is cuda, and torch finds no CUDA device here; use cpu")
    torch.manual_seed(config.seed)
    network = build_network(config.network, of_set=config.set, window=config.window)
    law = law or fit_servo_law(fit)
    data = to_device(fit, config.device)
    network.to(config.device).normalise_as(data.inputs, data.force)
    state = TrainingState.start(network, config)
    settings = training_settings(config, fit, validation)
    done = load_checkpoint(checkpoint, settings, state)
    held_out = to_device(validation, config.device)
    begun, first = time.monotonic(), done.epoch
    while not done.finished(config):
        train_error = run_epoch(state, data, config, done.epoch, law)
        error = validation_error(network, held_out)
        if not math.isfinite(error):
            raise InvalidParameter(
                f"epoch {done.epoch + 1}: the network's error must stay finite; it is {error}. A "
                f"learning_rate below {config.learning_rate:g} may help"
            )
        done = done.after_epoch(error, train_error, network)
        save_checkpoint(checkpoint, settings, state, done)
        pace = (time.monotonic() - begun) / (done.epoch - first)
        report(
            FittingProgress(
                epoch=done.epoch,
                epochs=config.epochs,
                train_rmse=train_error,
                validation_error=error,
                best_error=done.best_error,
                seconds_left=pace * (config.epochs - done.epoch),
            )
        )
    network.load_state_dict(done.kept_weights)
    return network.cpu().eval(), done


def run_epoch(
    state: TrainingState, data: WindowTensors, config: TrainingConfig, done: int, law: ServoLaw
) -> float:
    """Draw an epoch's windows, take one step per batch; return the error [N] that they had."""
    network, total, count = state.network, 0.0, 0
    network.train()
    order = torch.randperm(data.rows.shape[0], generator=state.generator)
    batches = order[: config.windows_per_epoch].split(config.batch)
    for number, chosen in enumerate(batches):
        share = (done + number / len(batches)) / config.epochs
        windows, targets = changed_batch(
            data, chosen.to(data.rows.device), config, share, law, state.generator
        )
        errors = network.last_query(windows) - targets[:, -1]
        loss = torch.mean((errors / network.force_scale) ** 2)
        state.descent.step(loss, share)
        total = total + loss.detach() * chosen.numel()
        count += chosen.numel()
    return float(torch.sqrt(torch.as_tensor(total) / count) * network.force_scale)


def validation_error(network: ForceNetwork, data: WindowTensors) -> float:
    """Return the mean absolute error [N] over held-out windows."""
    network.eval()
    chosen = torch.arange(0, data.rows.shape[0], VALIDATION_STRIDE, device=data.rows.device)
    with torch.no_grad():
        errors = [
            network.last_query(data.batch(part)) - data.targets(part)[:, -1]
            for part in chosen.split(VALIDATION_BATCH)
        ]
    return float(torch.cat(errors).abs().mean())
