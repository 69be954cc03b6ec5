"""Which recordings a network is fitted on, and which tell it when to stop."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tendon_newton.data.cards.force_network_card import TrainingRecording
from tendon_newton.data.checks.set_checks import servo_kinds
from tendon_newton.data.dataset import Dataset
from tendon_newton.data.files.origin import file_hash
from tendon_newton.data.recording import Recording
from tendon_newton.errors import InvalidDataset, listed
from tendon_train.actuator.samples.windows import Windows, WindowShape, extract_windows
from tendon_train.actuator.training_config import TrainingConfig

VALIDATION_SHARE = 0.15
"""Share of each bench's train recordings that is held out to stop the training [1]."""
SPLIT_WORDS = (
    "by recording: test recordings were never seen; validation recordings are whole train "
    "recordings that stopped the training"
)


@dataclass(frozen=True, kw_only=True)
class Fold:
    """The train recordings of a dataset in two parts."""

    fit: tuple[Recording, ...]  # Gradients come from these
    validation: tuple[Recording, ...]  # These say when to stop


def split_train(dataset: Dataset) -> Fold:
    """Hold out some whole train recordings of every bench that has several, always the same.

    Raises:
        InvalidDataset: There are fewer than two train recordings.
    """
    recordings = usable(dataset.train)
    if len(recordings) < 2:
        raise InvalidDataset(
            f"{dataset.path}: training needs two train recordings or more with theta_d and force, "
            f"one of them to tell it when to stop; there are {len(recordings)}"
        )
    if len(kinds := servo_kinds(recordings)) > 1:
        raise InvalidDataset(
            f"{dataset.path}: a force network knows one servo; the recordings are of "
            f"{listed(kinds)}: make a dataset for each"
        )
    rng = np.random.default_rng([0, len(recordings)])
    held: set[str] = set()
    for bench in sorted({r.bench for r in recordings}):
        names = sorted(r.name for r in recordings if r.bench == bench)
        count = max(1, round(VALIDATION_SHARE * len(names))) if len(names) > 1 else 0
        held.update(rng.permutation(names)[:count].tolist())
    if not held:
        held.add(recordings[int(rng.integers(len(recordings)))].name)
    return Fold(
        fit=tuple(r for r in recordings if r.name not in held),
        validation=tuple(r for r in recordings if r.name in held),
    )


def usable(recordings: Sequence[Recording]) -> tuple[Recording, ...]:
    """Return the recordings of a tendon under a known command; the pendulum has none."""
    return tuple(
        r
        for r in recordings
        if r.command is not None and r.force is not None and r.bench != "pendulum"
    )


def recorded_fold(path: Path, fold: Fold) -> tuple[TrainingRecording, ...]:
    """Describe the files of a fold as they stand in the folder of their dataset."""
    fitted = {recording.name for recording in fold.fit}
    return tuple(
        TrainingRecording(
            file=recording.name,
            sha256=file_hash(path / recording.name),
            split="train" if recording.name in fitted else "validation",
        )
        for recording in (*fold.fit, *fold.validation)
    )


@dataclass(frozen=True, kw_only=True)
class ForceData:
    """Windows for training and recordings for measuring a network."""

    fold: Fold
    fit: Windows
    validation: Windows
    test: tuple[Recording, ...]  # Recordings that only report


def prepare(dataset: Dataset, config: TrainingConfig) -> ForceData:
    """Cut a dataset into windows as a training asks for."""
    fold = split_train(dataset)
    shape = WindowShape(window=config.window, rate=config.rate)
    return ForceData(
        fold=fold,
        fit=extract_windows(fold.fit, shape),
        validation=extract_windows(fold.validation, shape),
        test=usable(dataset.test),
    )
