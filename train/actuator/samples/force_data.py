"""The windows of a dataset, split by recording."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from train.actuator.samples.folds import Fold, split_train, usable
from train.actuator.samples.windows import Windows, WindowShape, extract_windows

if TYPE_CHECKING:
    from tendon_newton.data.dataset import Dataset
    from tendon_newton.data.recording import Recording
    from train.actuator.training_config import TrainingConfig


@dataclass(frozen=True, kw_only=True)
class ForceData:
    """Windows for training and recordings for measuring a network."""

    fold: Fold
    fit: Windows
    validation: Windows
    test: tuple[Recording, ...]
    """Recordings that only report."""


def prepare(dataset: Dataset, config: TrainingConfig) -> ForceData:
    """Cut a dataset into windows as a training asks for."""
    fold = split_train(dataset, seed=config.fold_seed)
    shape = WindowShape(window=config.window, rate=config.rate)
    return ForceData(
        fold=fold,
        fit=extract_windows(fold.fit, shape),
        validation=extract_windows(fold.validation, shape),
        test=usable(dataset.test),
    )
