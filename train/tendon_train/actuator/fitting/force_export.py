"""From a trained network to its files."""

import dataclasses
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tendon_newton import __version__
from tendon_newton.data.cards.force_network_card import INPUTS, ForceNetworkCard, HeldOut, Training
from tendon_newton.data.checks.set_checks import servo_kinds
from tendon_newton.data.dataset import Dataset
from tendon_newton.data.files.origin import git_commit
from tendon_newton.data.root_mean_square import rms
from tendon_newton.force_networks.force_network import ForceNetwork, parameter_count
from tendon_train.actuator.prediction import predict
from tendon_train.actuator.samples.folds import SPLIT_WORDS, ForceData, recorded_fold
from tendon_train.actuator.samples.servo_law import fit_servo_law
from tendon_train.actuator.training_config import SERVO_LIMIT, TrainingConfig

HEADROOM = 1.05  # Above the largest force in training [1]


@dataclass(frozen=True, kw_only=True)
class ExportedNetwork:
    """The files of a network."""

    weights: Path  # Numbers alone: the form to share
    torchscript: Path
    onnx: Path
    card: ForceNetworkCard


def export_network(
    out: Path, network: ForceNetwork, config: TrainingConfig, dataset: Dataset, data: ForceData
) -> ExportedNetwork:
    """Measure a network on the test recordings and write it with its card."""
    # imported here, so that a machine without Warp can train: actuators load it
    from tendon_newton.actuators.networks.artifact import write_network
    from tendon_newton.actuators.networks.onnx_file import write_onnx
    from tendon_newton.force_networks.weights_file import SUFFIX, write_weights

    card = make_card(network, config, dataset, data)
    if data.test:
        card = dataclasses.replace(card, held_out=measure(network, card, data))
    torchscript = out / f"{config.name}.pt"
    weights, onnx = torchscript.with_suffix(SUFFIX), torchscript.with_suffix(".onnx")
    write_onnx(onnx, network, card)
    write_network(torchscript, network, card)
    write_weights(weights, network, card)
    return ExportedNetwork(weights=weights, torchscript=torchscript, onnx=onnx, card=card)


def make_card(
    network: ForceNetwork, config: TrainingConfig, dataset: Dataset, data: ForceData
) -> ForceNetworkCard:
    """Say what a network takes and gives, and where it comes from."""
    low, high = data.fit.inputs.min(axis=0), data.fit.inputs.max(axis=0)
    return ForceNetworkCard(
        kind=config.network,
        network_set=config.set,
        parameter_count=parameter_count(network),
        window=config.window,
        rate=config.rate,
        force_limit=config.force_limit or max(SERVO_LIMIT, HEADROOM * float(data.fit.force.max())),
        bounds={name: (float(low[i]), float(high[i])) for i, name in enumerate(INPUTS)},
        training=Training(
            recordings=recorded_fold(dataset.path, data.fold),
            split=SPLIT_WORDS,
            seed=config.seed,
            git_commit=git_commit(),
            version=__version__,
        ),
        servo=next(iter(servo_kinds(data.fold.fit)), None),
        hold=fit_servo_law(data.fit).hold,
        purpose=config.purpose,
    )


def measure(network: ForceNetwork, card: ForceNetworkCard, data: ForceData) -> HeldOut:
    """Return the errors on the test recordings."""
    from tendon_newton.identification.noise_floor import force_noise

    predictions = predict(network, card, data.test)
    errors = np.concatenate([p.error for p in predictions])
    return HeldOut(
        force_rmse=rms(errors),
        noise_floor=force_noise(data.test),
        rows=errors.size,
        recordings=tuple(r.name for r in data.test),
    )
