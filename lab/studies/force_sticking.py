"""Where force networks err, ``python -m lab.studies.force_sticking DATASET --networks DIR``.

Splits the rows of each test experiment by what the motor did within the network's window: it
turned, or it stuck for the whole of it, and prints the error of each part and its share of the
squared error. Where it stuck, friction holds any force within a band, and the window does not say
which.
"""

import argparse
from pathlib import Path

import numpy as np

from tendon_lab.force_scoring.compared_models import load_networks
from tendon_lab.force_scoring.sample_protocol import experiment_of
from tendon_newton.data.dataset import load_dataset
from tendon_newton.data.recording import Array, Mask
from tendon_train.actuator.prediction import ForcePrediction, predict
from tendon_train.actuator.samples.folds import usable

MOVED = 0.01
"""A motor whose angle spans less within a window has stuck [rad]: six counts of its encoder."""


def main() -> None:
    """Predict, split and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("dataset", type=Path)
    parser.add_argument("--networks", type=Path, nargs="+", required=True)
    arguments = parser.parse_args()
    dataset = load_dataset(arguments.dataset)
    for network in load_networks(arguments.networks, trust=False):
        window = network.card.window / network.card.rate
        found: dict[str, list[tuple[Array, Mask]]] = {}
        for prediction in predict(network.module, network.card, usable(dataset.test)):
            experiment = experiment_of(prediction.recording)
            label = "all steps" if experiment.hold is not None else experiment.label
            found.setdefault(label, []).append((prediction.error, stuck(prediction, window)))
        print(f"\n{network.path.name}: RMSE [N] where the motor turned, where it stuck")
        for label, parts in found.items():
            error, held = (np.concatenate(column) for column in zip(*parts, strict=True))
            share = np.sum(error[held] ** 2) / np.sum(error**2)
            print(
                f"  {label:45s} {rms(error[~held]):6.3f} {rms(error[held]):6.3f}   stuck: "
                f"{100 * np.mean(held):3.0f} % of rows, {100 * share:3.0f} % of squared error"
            )


def stuck(prediction: ForcePrediction, window: float) -> Mask:
    """Say for each row whether the motor had stuck for a whole window [s]."""
    time = prediction.recording.time
    angle = prediction.recording.motor_position[:, prediction.tendon]
    first = np.searchsorted(time, prediction.time - window)
    spans = [np.ptp(angle[a : b + 1]) for a, b in zip(first, prediction.rows, strict=True)]
    return np.array(spans) < MOVED


def rms(error: Array) -> float:
    """Return the root mean square, zero of nothing."""
    return float(np.sqrt(np.mean(error**2))) if error.size else 0.0


if __name__ == "__main__":
    main()
