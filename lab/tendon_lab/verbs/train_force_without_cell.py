"""Train a force network on recordings of benches without a load cell.

  tendon-newton train-force-without-cell recordings --out networks

reads no force of a train recording. The benches' springs, and on a finger the seen tip, imply it,
once the give of each tendon is found from what one servo does on all of them (NAME.lines.json). All
else is as with train-force.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from tendon_newton.cli.training.train_force import TrainForceConfig, train

if TYPE_CHECKING:
    from pathlib import Path

    from tendon_newton.data.dataset import Dataset


def main(config: TrainForceConfig) -> None:
    """Find the force that the motion implies, and learn it."""
    from tendon_lab.without_cell.sensorless import IMPLIED_WORDS
    from tendon_newton.data.dataset import load_dataset
    from tendon_newton.data.files.output_folder import make_folder

    dataset = load_dataset(config.dataset, require_test=False)
    out = make_folder(config.out)
    implied = imply(dataset, out / f"{config.training.name}.lines.json")
    train(implied, config.training, out, IMPLIED_WORDS)


def imply(dataset: Dataset, file: Path) -> Dataset:
    """Put implied forces in place of measured ones; write and print what implies them."""
    from tendon_lab.without_cell.sensorless import imply_forces, write_lines

    print("finding what each bench's tendon gives, from encoders and tip ...", flush=True)
    implied = imply_forces(dataset)
    write_lines(file, implied.lines)
    for line in implied.lines:
        print(
            f"  {line.bench}: {line.stiffness:.0f} N/m after {1e3 * line.slack:.2f} mm of slack, "
            f"guide friction {line.friction:.3f}"
        )
    return implied.dataset
