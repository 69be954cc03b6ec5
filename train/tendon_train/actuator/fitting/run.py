"""One force network from a dataset to its files, watched and resumable."""

from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path

import torch

from tendon_newton.data.dataset import Dataset
from tendon_newton.data.files.json_file import write_json
from tendon_train.actuator.fitting.force_export import ExportedNetwork, export_network
from tendon_train.actuator.fitting.training import FittingProgress, train_network
from tendon_train.actuator.samples.folds import prepare
from tendon_train.actuator.training_config import TrainingConfig


def train_to_file(
    dataset: Dataset,
    config: TrainingConfig,
    out: Path,
    *,
    report: Callable[[FittingProgress], None],
) -> ExportedNetwork:
    """Train a network and write its files; what is finished already is not done again.

    Writes NAME.checkpoint, NAME.json with the errors after each epoch, a TensorBoard log,
    NAME.safetensors, NAME.pt and NAME.onnx.
    """
    torch.set_num_threads(config.threads)
    data = prepare(dataset, config)
    log = TrainingLog(out / "tensorboard" / config.name)
    try:
        network, done = train_network(
            config,
            data.fit,
            data.validation,
            out / f"{config.name}.checkpoint",
            report=lambda progress: (log.write(progress), report(progress))[1],
        )
    finally:
        log.close()
    history = {
        "config": asdict(config),
        "epochs": done.epoch,
        "kept_epoch": done.kept_epoch,
        "validation_error_n": done.history[done.kept_epoch - 1][1],
        "history_n": [list(pair) for pair in done.history],
    }
    write_json(out / f"{config.name}.json", history)
    return export_network(out, network, config, dataset, data)


class TrainingLog:
    """A TensorBoard log of a training, opened when there is something to write."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._writer = None

    def write(self, progress: FittingProgress) -> None:
        """Add an epoch."""
        if self._writer is None:
            from torch.utils.tensorboard import SummaryWriter

            self._writer = SummaryWriter(str(self._folder))
        self._writer.add_scalar("error_n/train", progress.train_rmse, progress.epoch)
        self._writer.add_scalar("error_n/validation", progress.validation_error, progress.epoch)

    def close(self) -> None:
        """Finish the log."""
        if self._writer is not None:
            self._writer.close()
