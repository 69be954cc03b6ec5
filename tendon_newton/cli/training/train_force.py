"""Train a force network on recordings of a bench with a load cell.

  tendon-newton train-force recordings --network transformer --set paper --seed 0 --out networks

The network predicts the tension of a tendon from the last 1.5 s of commanded angle, angle and speed
of its servo. Whole train recordings are held out to stop the training; test recordings only report.
OUT gets the network (NAME.safetensors to use and share, NAME.pt, NAME.onnx), how the training went
(NAME.json, a TensorBoard log) and a checkpoint. The same command goes on with a training that was
interrupted.

  tendon-newton train-force recordings --purpose simulation --out networks

makes a network for simulations, which also knows the servo's force beside all recorded motion. Such
a network is less exact along recordings, and several times as exact in a closed loop.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from tendon_newton.data.files.output_folder import make_folder
from tendon_newton.device_code.quiet import quiet_warp
from tendon_train.actuator.training_config import SERVO_LIMIT, TrainingConfig

if TYPE_CHECKING:
    from tendon_train.actuator.fitting.training import FittingProgress


@dataclass(frozen=True, kw_only=True)
class TrainForceConfig:
    """Train a force network on recordings of a bench with a load cell."""

    dataset: Annotated[Path, tyro.conf.Positional]  # Folder with dataset.toml and its recordings.
    out: Path  # Folder for the files; made if it is not there.
    training: tyro.conf.OmitArgPrefixes[TrainingConfig] = field(default_factory=TrainingConfig)
    """Settings that decide the training."""


def main(config: TrainForceConfig) -> None:
    """Train, write the network and print its errors."""
    from tendon_newton.data.dataset import load_dataset
    from tendon_train.actuator.fitting.run import train_to_file

    dataset = load_dataset(config.dataset, require_test=False)
    out = make_folder(config.out, config.dataset)
    quiet_warp()
    exported = train_to_file(dataset, config.training, out, report=show)
    card = exported.card
    print(
        f"\nwrote {exported.weights}, to use and to share, {exported.torchscript.name} and "
        f"{exported.onnx.name}: {card.parameter_count} numbers"
    )
    print(
        f"in a simulation its force answers to the shaft by {card.hold.stiffness:.1f} N/rad and "
        f"{card.hold.damping:.1f} N s/rad between two queries"
    )
    if card.held_out is not None:
        error, floor = card.held_out.force_rmse, card.held_out.noise_floor
        share = 100.0 * error / SERVO_LIMIT
        noise = "" if floor is None else f"; the load cell's noise is {floor:.3f} N"
        print(
            f"held-out force error {error:.3f} N RMS on {len(card.held_out.recordings)} recordings,"
            f" {share:.1f} % of {SERVO_LIMIT:g} N{noise}"
        )


def show(progress: FittingProgress) -> None:
    """Print a line about an epoch."""
    print(
        f"  epoch {progress.epoch:4d} of {progress.epochs}   train {progress.train_rmse:.3f} N   "
        f"validation {progress.validation_error:.3f} N   best {progress.best_error:.3f} N   "
        f"at most {duration(progress.seconds_left)} left",
        flush=True,
    )


def duration(seconds: float) -> str:
    """Write a time in words."""
    return f"{seconds:.0f} s" if seconds < 120.0 else f"{seconds / 60.0:.0f} min"
