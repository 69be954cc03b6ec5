"""A force network without a load cell: train recordings whose force their motion implies.

The lines of all benches are found first, from encoders and tip alone. Each line then implies the
force at its spool, and a network learns that force as it would learn a measurement.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from tendon_lab.without_cell.sensorless_fit import LineFit, fit_lines
from tendon_lab.without_cell.sensorless_line import Line
from tendon_lab.without_cell.sensorless_motion import SensorlessMotion, motions_of
from tendon_newton.data.dataset import Dataset
from tendon_newton.data.files.json_file import write_json
from tendon_newton.data.recording import Recording
from tendon_train.actuator.samples.folds import SPLIT_WORDS

IMPLIED_WORDS = f"{SPLIT_WORDS}; the force of the train recordings is implied by their motion"
"""What the card of a network says that was trained without a load cell."""


@dataclass(frozen=True, kw_only=True)
class ImpliedForces:
    """Train recordings with implied forces, and what implies them."""

    dataset: Dataset
    """Dataset with the implied force in its train recordings, in place of a measured one [N]."""
    lines: tuple[Line, ...]  # Line of each bench


def imply_forces(dataset: Dataset, config: LineFit | None = None) -> ImpliedForces:
    """Replace the force of every train recording by the one that its motion implies.

    What a load cell read is dropped first and has no part in it. Test recordings stay as they are:
    they only report.

    Args:
        dataset: Recordings, split.
        config: Length of the fit of the lines.

    Raises:
        InvalidDataset: No train recording tells anything without a force.
    """
    motions = motions_of(dataset.train)
    lines = fit_lines(motions, config or LineFit())
    return ImpliedForces(dataset=replace(dataset, train=with_tension(motions, lines)), lines=lines)


def with_tension(
    motions: Sequence[SensorlessMotion], lines: Sequence[Line]
) -> tuple[Recording, ...]:
    """Return the recordings with the force that the lines imply."""
    of_bench = {line.bench: line for line in lines}
    return tuple(
        replace(motion.recording, force=of_bench[motion.recording.bench].tension(motion)[:, None])
        for motion in motions
    )


def write_lines(path: Path, lines: Sequence[Line]) -> None:
    """Write what was found of the benches; N/m, m and 1."""
    write_json(path, [asdict(line) for line in lines])
