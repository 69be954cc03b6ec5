"""The models that an evaluation compares: network files and the ideal source."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tendon_lab.force_scoring.ideal_baseline import PAPER_GAIN, ideal_force, refitted_gain
from tendon_newton.actuators.networks.artifact import NetworkFile, load_network
from tendon_newton.data.dataset import Dataset
from tendon_newton.data.files.origin import file_hash
from tendon_newton.data.recording import Recording
from tendon_newton.errors import InvalidNetworkFile
from tendon_newton.force_networks.weights_file import SUFFIX
from tendon_train.actuator.prediction import ForcePrediction, predict
from tendon_train.actuator.training_config import SERVO_LIMIT

IDEAL, REFITTED = "ideal", "ideal refitted"


@dataclass(frozen=True, kw_only=True)
class Compared:
    """One model's predictions on all test recordings."""

    name: str  # Name of the file, or of the ideal source
    family: str  # What it shares with networks that differ in the seed alone
    predictions: tuple[ForcePrediction, ...]
    network: NetworkFile | None = None
    gain: float | None = None  # Gain of an ideal source [N/rad]


def load_networks(paths: Sequence[Path], *, trust: bool) -> tuple[NetworkFile, ...]:
    """Read network files; a folder stands for all that lie in it.

    Raises:
        InvalidNetworkFile: A folder holds none, or one file cannot be used.
    """
    files: list[Path] = []
    for path in paths:
        # of a network in both forms the one that holds no code
        forms = {file.stem: file for suffix in (".pt", SUFFIX) for file in path.glob(f"*{suffix}")}
        found = [forms[stem] for stem in sorted(forms)] if path.is_dir() else [path]
        if not found:
            raise InvalidNetworkFile(f"{path}: no force network (*{SUFFIX}, *.pt) in this folder")
        files += found
    return tuple(load_network(file, trust=trust) for file in files)


def compare(
    networks: Sequence[NetworkFile], dataset: Dataset, recordings: Sequence[Recording]
) -> tuple[Compared, ...]:
    """Predict the test recordings with every network and with the ideal source, twice.

    The ideal source has once the paper's gain and once the one that fits the train recordings best.
    All models are compared at the rows that all of them predict, and clipped to the same limit.
    """
    for network in networks:
        refuse_seen(network, dataset, recordings)
    models = [
        Compared(
            name=network.path.stem,
            family=family_of(network),
            predictions=predict(network.module, network.card, recordings),
            network=network,
        )
        for network in networks
    ]
    limit = max([SERVO_LIMIT, *(network.card.force_limit for network in networks)])
    train = [r for r in dataset.train if r.command is not None and r.force is not None]
    gains = {IDEAL: PAPER_GAIN}
    if train:
        gains[REFITTED] = refitted_gain(train, limit)
    for name, gain in gains.items():
        predictions = tuple(
            ideal_prediction(recording, tendon, gain, limit)
            for recording in recordings
            for tendon in range(recording.tendon_count)
        )
        models.append(Compared(name=name, family=name, predictions=predictions, gain=gain))
    return at_common_rows(models)


def refuse_seen(network: NetworkFile, dataset: Dataset, recordings: Sequence[Recording]) -> None:
    """Refuse to test a network on a recording that it was trained on."""
    seen = {recording.sha256: recording.file for recording in network.card.training.recordings}
    for recording in recordings:
        file = dataset.path / recording.name
        if file.exists() and (name := seen.get(file_hash(file))) is not None:
            raise InvalidNetworkFile(
                f"{network.path}: was trained on {name}, which is the test recording "
                f"{recording.name}; errors on it would say nothing"
            )


def family_of(network: NetworkFile) -> str:
    """Return what a network shares with those that differ in the seed alone."""
    card = network.card
    history = "" if card.window / card.rate == 1.5 else f" {card.window / card.rate:g} s"
    purpose = "" if card.purpose == "prediction" else f" for {card.purpose}"
    return f"{card.kind}{purpose} ({card.network_set}){history}"


def ideal_prediction(
    recording: Recording, tendon: int, gain: float, limit: float
) -> ForcePrediction:
    """Predict every row of a recording with an ideal source."""
    assert recording.force is not None
    return ForcePrediction(
        recording=recording,
        tendon=tendon,
        rows=np.arange(recording.sample_count),
        measured=recording.force[:, tendon],
        predicted=ideal_force(recording, tendon, gain, limit),
    )


def at_common_rows(models: Sequence[Compared]) -> tuple[Compared, ...]:
    """Keep the rows that every model predicts."""
    common: dict[tuple[str, int], set[int]] = {}
    for model in models:
        own = {p.key: set(p.rows.tolist()) for p in model.predictions}
        common = own if not common else {k: common[k] & own[k] for k in common.keys() & own.keys()}
    return tuple(
        Compared(
            name=model.name,
            family=model.family,
            predictions=tuple(
                p.at(np.array(sorted(common[p.key]), dtype=np.intp))
                for p in model.predictions
                if common.get(p.key)
            ),
            network=model.network,
            gain=model.gain,
        )
        for model in models
    )
