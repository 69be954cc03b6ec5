"""Train many force networks with one command.

The command is ``python -m tendon_lab.sweep DATASET --out DIR``. Each network
is one job; what is finished is skipped, and what was interrupted goes on, so that
the same command can be given again, here or on another machine. A machine without Warp and ONNX
trains with ``--no-export``; the same command without it, given where the two are installed, then
writes the network files from the checkpoints.
"""

import logging
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Annotated

import tyro

from tendon_newton.data.dataset import Dataset, load_dataset
from tendon_newton.data.files.output_folder import make_folder
from tendon_newton.force_networks import FORCE_NETWORKS, SETS, SetName, kinds_in
from tendon_newton.scheduler import JobOptions, completed
from tendon_train.actuator.fitting.run import train_to_file
from tendon_train.actuator.fitting.training import FittingProgress
from tendon_train.actuator.training_config import Kind, Purpose, TrainingConfig

LOG = logging.getLogger(__name__)
REPORT_EVERY = 10  # Epochs between two lines of a network.


@dataclass(frozen=True, kw_only=True)
class SweepConfig:
    """Which networks to train, and how."""

    dataset: Annotated[Path, tyro.conf.Positional]  # Folder with dataset.toml and its recordings.
    out: Path  # Folder for the files of all networks.
    networks: tuple[Kind, ...] = tuple(FORCE_NETWORKS)  # Families.
    sets: tuple[SetName, ...] = SETS
    """Sets of sizes; a family that has none in a set is left out there."""
    purpose: Purpose = "prediction"
    """What they are for: forces along measured motion, or the loop of a simulation."""
    seeds: tuple[int, ...] = (0, 1, 2)  # Seeds.
    epochs: int = 30  # Most epochs of each.
    patience: int = 30  # Epochs without a better validation error after which a training stops.
    windows_per_epoch: int = 32768  # Windows that an epoch draws.
    batch: int = 128  # Windows per step.
    window: int = 30  # Samples that a network sees.
    device: str = "cpu"  # cpu or cuda.
    jobs: tyro.conf.OmitArgPrefixes[JobOptions] = field(default_factory=JobOptions)
    """Where networks are trained."""
    export: bool = True  # Whether to write the network files; they need Warp and ONNX installed.

    def trainings(self) -> Iterator[TrainingConfig]:
        """Yield what is to be trained."""
        for seed in self.seeds:
            for of_set in self.sets:
                for network in (kind for kind in self.networks if kind in kinds_in(of_set)):
                    yield TrainingConfig(
                        network=network,
                        set=of_set,
                        purpose=self.purpose,
                        seed=seed,
                        epochs=self.epochs,
                        patience=self.patience,
                        windows_per_epoch=self.windows_per_epoch,
                        batch=self.batch,
                        window=self.window,
                        device=self.device,
                    )


def main(config: SweepConfig) -> None:
    """Train everything that is not finished."""
    make_folder(config.out)
    trainings = list(config.trainings())
    begun = time.monotonic()
    jobs = [(config, training) for training in trainings]
    for done, (_, name) in enumerate(completed(run_job, jobs, config.jobs), start=1):
        pace = (time.monotonic() - begun) / done
        LOG.info(
            "%s finished: %d of %d, about %.0f min left",
            name,
            done,
            len(trainings),
            pace * (len(trainings) - done) / 60.0,
        )


def run_job(job: tuple[SweepConfig, TrainingConfig]) -> str:
    """Train one network."""
    log_to_terminal()
    config, training = job

    def report(progress: FittingProgress) -> None:
        if progress.epoch % REPORT_EVERY == 0:
            LOG.info(
                "%s: epoch %d, validation %.3f N, best %.3f N",
                training.name,
                progress.epoch,
                progress.validation_error,
                progress.best_error,
            )

    train_to_file(
        dataset_at(config.dataset), training, config.out, report=report, export=config.export
    )
    return training.name


@cache
def dataset_at(path: Path) -> Dataset:
    """Read a dataset once per process."""
    return load_dataset(path, require_test=False)


def log_to_terminal() -> None:
    """Write what is logged to the terminal, with the time."""
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(message)s", datefmt="%H:%M:%S")


if __name__ == "__main__":
    log_to_terminal()
    main(tyro.cli(SweepConfig, description=__doc__))
