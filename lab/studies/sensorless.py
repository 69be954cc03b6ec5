"""What a force network learns without a load cell.

``python -m lab.studies.sensorless DATASET --networks SUPERVISED --out DIR`` finds the lines of
the benches, trains networks on the force that they imply, and prints their error on the test steps
beside that of networks which had the load cell, of the ideal source, of the implied forces
themselves, and of what the nominal springs and weights imply: by bench, by what the servo does, and
how much of it is one and the same on all of a bench's steps. What is finished is not done again.
``--seeds`` without a number trains none; ``--tip-noise 3e-4`` blurs the tip of the train recordings
[m], and ``--tip-offset 5e-4 0`` has the camera see x and z of every tip off their place [m].
"""

import argparse
import json
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from tendon_lab.force_scoring.ideal_baseline import PAPER_GAIN, ideal_force, refitted_gain
from tendon_lab.force_scoring.sample_protocol import step_hold
from tendon_lab.without_cell.sensorless import IMPLIED_WORDS, imply_forces, write_lines
from tendon_lab.without_cell.sensorless_line import Line, nominal_line
from tendon_lab.without_cell.sensorless_motion import SensorlessMotion, motions_of
from tendon_newton.actuators.networks.artifact import NetworkFile, load_network
from tendon_newton.data.dataset import Dataset, load_dataset
from tendon_newton.data.recording import Array, Recording
from tendon_newton.mechanisms.geometry.statics import gravity_torque
from tendon_train.actuator.fitting.run import train_to_file
from tendon_train.actuator.prediction import predict
from tendon_train.actuator.samples.folds import usable
from tendon_train.actuator.samples.servo_law import SLIDING
from tendon_train.actuator.training_config import SERVO_LIMIT, TrainingConfig

BENCHES = ("finger", "spring_strong", "spring_weak")
PHASES = ("winds in", "driven back", "rests")
Model = Callable[[Sequence[Recording]], list[Array]]
"""Recordings -> predicted less measured force [N] at the rows of each; nan where none is said."""


def main() -> None:
    """Find, train, measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("dataset", type=Path)
    parser.add_argument("--networks", type=Path, help="networks that had the load cell")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--network", default="transformer", choices=["mlp", "rnn", "transformer"])
    parser.add_argument("--seeds", type=int, nargs="*", default=[0, 1, 2])
    parser.add_argument("--epochs", type=int, default=30)
    parser.add_argument("--windows-per-epoch", type=int, default=32768)
    parser.add_argument("--tip-noise", type=float, default=0.0)
    parser.add_argument("--tip-offset", type=float, nargs=2, default=[0.0, 0.0])
    chosen = parser.parse_args()
    chosen.out.mkdir(parents=True, exist_ok=True)
    dataset = with_tip_offset(load_dataset(chosen.dataset), chosen.tip_offset)
    dataset = with_tip_noise(dataset, chosen.tip_noise)
    implied = imply_forces(dataset)
    write_lines(chosen.out / "benches.json", implied.lines)
    print_lines(implied.lines)
    table = {
        "ideal, 4.2 N/rad": errors(ideal(PAPER_GAIN), dataset),
        "ideal refitted (with the load cell)": errors(
            ideal(refitted_gain(usable(dataset.train), SERVO_LIMIT)), dataset
        ),
        "nominal springs and weights": errors(static, dataset),
        "force of the nominal lines": errors(lines_of(nominal_lines(dataset)), dataset),
        "force of the found lines": errors(lines_of(implied.lines), dataset),
        "the same without guide friction": errors(
            lines_of([replace(line, friction=0.0) for line in implied.lines]), dataset
        ),
    }
    own = [
        trained(
            implied.dataset,
            TrainingConfig(
                network=chosen.network,
                seed=seed,
                epochs=chosen.epochs,
                patience=chosen.epochs,
                windows_per_epoch=chosen.windows_per_epoch,
            ),
            chosen.out,
        )
        for seed in chosen.seeds
    ]
    if own:
        table["without the load cell"] = mean_errors(own, dataset)
        table["the mean of these forces"] = errors(ensemble(own), dataset)
    if own and chosen.networks is not None:
        paths = sorted(chosen.networks.glob(f"{chosen.network}-paper-[0-9]*.pt"))
        with_cell = [load_network(path, trust=True) for path in paths]
        table["with the load cell"] = mean_errors(with_cell, dataset)
        table["the mean of those forces"] = errors(ensemble(with_cell), dataset)
        ratios = {
            key: table["without the load cell"][key] / table["with the load cell"][key]
            for key in ("steps", *BENCHES, "all rows", *PHASES)
        }
        table["without over with [1]"] = ratios
    print_table(table)
    (chosen.out / "sensorless.json").write_text(json.dumps(table, indent=1) + "\n")


def trained(dataset: Dataset, config: TrainingConfig, out: Path) -> NetworkFile:
    """Train a network on implied forces, unless it is there, and read its file."""
    exported = train_to_file(
        dataset, config, out, report=lambda progress: None, split=IMPLIED_WORDS
    )
    assert exported is not None
    print(f"trained {exported.torchscript.name}", flush=True)
    return load_network(exported.torchscript, trust=True)


def errors(model: Model, dataset: Dataset) -> dict[str, float]:
    """Return RMS errors [N].

    Mean over the step trajectories, in all and by bench; pooled over all test rows, and over the
    steps' rows by what the servo does; ``offset``, that of the mean errors on each bench's steps.
    """
    steps = [r for r in usable(dataset.test) if step_hold(r) is not None]
    missed = model(steps)
    by_recording = [rms(e) for e in missed]
    found, offsets = {"steps": float(np.mean(by_recording))}, []
    for bench in BENCHES:
        own = [k for k, r in enumerate(steps) if r.bench == bench]
        found[bench] = float(np.mean([by_recording[k] for k in own])) if own else float("nan")
        if own:
            offsets.append(np.nanmean(np.concatenate([missed[k] for k in own])))
    found["all rows"] = rms(np.concatenate(model(usable(dataset.test))))
    found["offset"] = rms(np.array(offsets))
    pooled = np.concatenate(missed)
    speed = np.concatenate([r.motor_velocity[:, 0] for r in steps])
    rows = (speed > SLIDING, speed < -SLIDING, np.abs(speed) <= SLIDING)
    return found | {name: rms(pooled[own]) for name, own in zip(PHASES, rows, strict=True)}


def rms(values: Array) -> float:
    """Return the root mean square of those that are not nan."""
    return float(np.sqrt(np.nanmean(values**2)))


def mean_errors(networks: Sequence[NetworkFile], dataset: Dataset) -> dict[str, float]:
    """Return the errors of networks that differ in their seed: their mean, and its spread [N]."""
    each = [errors(network_model(network), dataset) for network in networks]
    mean = {key: float(np.mean([found[key] for found in each])) for key in each[0]}
    spread = float(np.std([found["steps"] for found in each], ddof=1)) if len(each) > 1 else 0.0
    return mean | {"spread of steps": spread}


def network_model(network: NetworkFile) -> Model:
    """Return a network's errors as a function of recordings."""

    def model(recordings: Sequence[Recording]) -> list[Array]:
        missed = {r.name: np.full(r.sample_count, np.nan) for r in recordings}
        for prediction in predict(network.module, network.card, recordings):
            missed[prediction.recording.name][prediction.rows] = -prediction.error
        return list(missed.values())

    return model


def ensemble(networks: Sequence[NetworkFile]) -> Model:
    """Return the errors of the mean of several networks' forces."""
    models = [network_model(network) for network in networks]
    return lambda recordings: [
        np.mean(each, axis=0) for each in zip(*(model(recordings) for model in models), strict=True)
    ]


def ideal(gain: float) -> Model:
    """Return an ideal source's errors as a function of recordings."""
    return lambda recordings: [
        ideal_force(r, 0, gain, SERVO_LIMIT) - measured(r) for r in recordings
    ]


def lines_of(lines: Sequence[Line]) -> Model:
    """Return as a function of recordings how far the force that lines imply is from the cell's."""
    of_bench = {line.bench: line for line in lines}

    def model(recordings: Sequence[Recording]) -> list[Array]:
        pairs = zip(recordings, motions_of(recordings), strict=True)
        return [of_bench[r.bench].tension(motion) - measured(r) for r, motion in pairs]

    return model


def static(recordings: Sequence[Recording]) -> list[Array]:
    """Return how far a rigid line on the nominal mechanism at rest is from the cell [N]."""
    found = []
    for recording, motion in zip(recordings, motions_of(recordings), strict=True):
        mechanism = motion.mechanism
        arms = mechanism.tendons[0].moment_arm
        joints = motion.joints if motion.joints.size else motion.wound[:, None] / arms
        weight = np.array([gravity_torque(mechanism, q)[0] for q in joints])
        first = mechanism.joints[0]
        torque = first.stiffness * (joints[:, 0] - first.rest) - weight
        found.append(np.maximum(0.0, torque / arms[0]) - measured(recording))
    return found


def with_tip_noise(dataset: Dataset, noise: float) -> Dataset:
    """Blur the tip of the train recordings by white noise [m]."""
    rng = np.random.default_rng(0)
    blurred = tuple(
        r if r.tip is None else replace(r, tip=r.tip + rng.normal(0.0, noise, r.tip.shape))
        for r in dataset.train
    )
    return replace(dataset, train=blurred)


def with_tip_offset(dataset: Dataset, offset: Sequence[float]) -> Dataset:
    """Move the tip of all recordings by x and z [m]."""
    train, test = (
        tuple(r if r.tip is None else replace(r, tip=r.tip + np.asarray(offset)) for r in split)
        for split in (dataset.train, dataset.test)
    )
    return replace(dataset, train=train, test=test)


def measured(recording: Recording) -> Array:
    """Return what the load cell read [N]."""
    assert recording.force is not None
    return recording.force[:, 0]


def nominal_lines(dataset: Dataset) -> list[Line]:
    """Return what assets and handbook promise of every bench."""
    motions: dict[str, SensorlessMotion] = {m.recording.bench: m for m in motions_of(dataset.train)}
    return [nominal_line(bench, motion.mechanism) for bench, motion in motions.items()]


def print_lines(lines: Sequence[Line]) -> None:
    """Print what was found of the benches."""
    for line in lines:
        arms = "".join(f"  arm {1e3 * arm:.2f} mm" for arm in line.arms)
        print(
            f"{line.bench:14s} {line.stiffness:6.0f} N/m  slack {1e3 * line.slack:5.2f} mm  "
            f"guide friction {line.friction:.3f}{arms}",
            flush=True,
        )


def print_table(table: dict[str, dict[str, float]]) -> None:
    """Print the errors [N]."""
    columns = ("steps", *BENCHES, "all rows", *PHASES, "offset", "spread of steps")
    print(f"{'RMSE [N]':36s}" + "".join(f"{name:>{len(name) + 2}s}" for name in columns))
    for name, found in table.items():
        cells = (
            f"{found[key]:{len(key) + 2}.3f}" if key in found else " " * (len(key) + 2)
            for key in columns
        )
        print(f"{name:36s}" + "".join(cells))


if __name__ == "__main__":
    main()
