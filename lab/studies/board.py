"""Scorer of the board: what a program predicts beside what was measured, in one file.

``python -m lab.studies.board DATASET PREDICTED`` compares the test recordings of a dataset
with files of the same names that any program may have written: CSV with a column ``t`` and any of
``theta``, ``force`` and ``joint_angle``, in SI units. A signal that drives the simulation is no
prediction and is not scored. Instants of a file need not be those of the recording.

Beside the errors stands what runs of one command differ by, below which no program can come.
"""

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from tendon_newton.data.dataset import load_dataset
from tendon_newton.data.recording import Array, Recording
from tendon_newton.data.root_mean_square import rms
from tendon_newton.errors import InvalidRecording, listed

SIGNALS = {"theta": "mrad", "joint_angle": "mrad", "force": "mN or mN m"}
"""Column -> unit of its errors, a thousandth of the column's own."""
SEED = 0
DRAWS = 2000


def measured(recording: Recording) -> dict[str, Array]:
    """Return what a program has to predict of a recording, by column, shape (T,) each."""
    out = {}
    if recording.driven_by != "path":
        out["theta"] = recording.motor_position[:, 0]
    if recording.joint_position is not None:
        out["joint_angle"] = recording.joint_position[:, 0]
    if recording.force is not None and recording.driven_by != "force":
        out["force"] = recording.force[:, 0]
    return out


def read_prediction(path: Path) -> dict[str, Array]:
    """Read the columns of a prediction, shape (T,) each.

    Raises:
        InvalidRecording: It is no CSV file of numbers with a header and ``t``.
    """
    try:
        table = np.atleast_1d(np.genfromtxt(path, delimiter=",", names=True))
    except (OSError, ValueError) as error:
        raise InvalidRecording(f"{path}: a prediction is a CSV file; {error}") from error
    columns = {name: table[name] for name in table.dtype.names or ()}
    if "t" not in columns:
        raise InvalidRecording(
            f"{path}: a prediction has a column t in its first line; it has {listed(columns)}"
        )
    return columns


def errors(recording: Recording, folder: Path) -> dict[str, Array]:
    """Return measured minus predicted of one recording, by column, shape (T,) each.

    Raises:
        InvalidRecording: The file is not there, or has none of the signals, or ends too early.
    """
    path = folder / Path(recording.name).with_suffix(".csv").name
    columns = read_prediction(path)
    time, truth = columns["t"], measured(recording)
    if time[0] > recording.time[0] or time[-1] < recording.time[-1]:
        raise InvalidRecording(
            f"{path}: t must reach from {recording.time[0]:g} to {recording.time[-1]:g} s; it goes "
            f"from {time[0]:g} to {time[-1]:g} s"
        )
    found = {
        name: signal - np.interp(recording.time, time, columns[name])
        for name, signal in truth.items()
        if name in columns
    }
    if not found:
        raise InvalidRecording(
            f"{path}: a prediction has one of {listed(truth)}; it has {listed(columns)}"
        )
    return found


def interval(sizes: Array) -> tuple[float, float]:
    """Return the 95 % interval of the RMS over recordings, drawn with replacement."""
    draws = np.random.default_rng(SEED).choice(sizes, (DRAWS, len(sizes)))
    low, high = np.quantile(np.sqrt((draws**2).mean(axis=1)), (0.025, 0.975))
    return float(low), float(high)


def scores(recordings: tuple[Recording, ...], folder: Path) -> Mapping[str, Array]:
    """Return the RMS error of each recording in thousandths of its unit, by column, (N,) each."""
    out: dict[str, list[float]] = {}
    for recording in recordings:
        for name, error in errors(recording, folder).items():
            out.setdefault(name, []).append(1.0e3 * rms(error))
    return {name: np.array(sizes) for name, sizes in out.items()}


def floors(recordings: Sequence[Recording]) -> Mapping[str, float]:
    """Return the spread of runs that share a command, in thousandths of the unit, by column.

    Rows before the command first moves are left out: what ran before decides where a run begins.
    """
    groups: dict[bytes, list[Recording]] = {}
    for recording in recordings:
        if recording.command is not None and recording.obstacle == "free":
            groups.setdefault(recording.command.tobytes(), []).append(recording)
    spreads: dict[str, list[Array]] = {}
    for first, *others in groups.values():
        if others and first.command is not None:
            begin = int(np.argmax(np.any(first.command != first.command[0], axis=1)))
            for name in measured(first):
                runs = np.stack([measured(run)[name][begin:] for run in (first, *others)])
                spreads.setdefault(name, []).append(runs.std(axis=0, ddof=1))
    return {name: 1.0e3 * rms(np.concatenate(own)) for name, own in spreads.items()}


def main() -> None:
    """Print the RMS error of each signal over the test recordings, with its interval."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("dataset", type=Path)
    parser.add_argument("predicted", type=Path)
    arguments = parser.parse_args()
    recordings = load_dataset(arguments.dataset, require_train=False).test
    least = floors(recordings)
    for name, sizes in scores(recordings, arguments.predicted).items():
        low, high = interval(sizes)
        repeats = f"; repeats differ by {least[name]:.2f}" if name in least else ""
        print(
            f"{name:12s} {rms(sizes):7.2f} [{low:.2f}, {high:.2f}] {SIGNALS[name]} RMS over "
            f"{len(sizes)} recordings, worst {sizes.max():.1f}{repeats}"
        )


if __name__ == "__main__":
    main()
