"""A verb that reads a dataset and a model and does nothing with them."""

from dataclasses import dataclass
from pathlib import Path

import tyro

from tendon_newton.data.dataset import load_dataset
from tendon_newton.data.model_file import load_model


@dataclass(frozen=True, kw_only=True)
class ReadingConfig:
    """What every verb that simulates starts from."""

    dataset: tyro.conf.Positional[Path]
    """Folder of the dataset."""
    model: Path
    """Model file."""


def main(config: ReadingConfig) -> None:
    """Read both, dataset first."""
    load_dataset(config.dataset)
    load_model(config.model)
