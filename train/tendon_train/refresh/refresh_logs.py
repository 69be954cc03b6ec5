"""Logs of deployments, read for a refresh."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from tendon_newton.data.dataset import Dataset, read_entries, read_recording
from tendon_newton.data.recording import Recording
from tendon_newton.errors import InvalidDataset
from tendon_newton.identification.cutting import beginning, hold_out, rows_of

HELD_OUT = 1.0 / 3.0  # Share of each log that only tells how good the corrected model is [1]
BEGINNING = 2.0  # Length of what is left out [s]
LOOSE = 0.2
"""Motor angle up to which the tendon may hang loose [rad]: the open finger hangs by its weight, and
a homed tendon is not quite taut."""
REST = 0.02  # Way of the motor that counts as rest [rad]: 13 counts of its encoder
SETTLING = 1.0  # Rest that stays in a log [s]: what friction holds shows there
LEAST_PART = 1.0  # Length without which what lies between two loose rows is left out as well [s]


def read_logs(
    paths: Sequence[Path], policy_span: Callable[[Path], float | None] = lambda path: None
) -> tuple[Recording, ...]:
    """Read logs: whole folders of deployments, or files that such a folder lists.

    Logs hold what the servo says of itself. A load cell is left out: most robots have none, and
    what its readings jump by while a policy acts no wear explains.

    Args:
        policy_span: Says how long the policy acted in a log [s], None where it is not known. What
            follows is the way home, on which the servo turns the spool until the tendon hangs
            loose; it is left out. A rest at the end is left out too: every model is right on it.

    Raises:
        InvalidDataset: There is none, or a folder does not list a file.
    """
    files = log_files(paths)
    if not files:
        raise InvalidDataset("a refresh needs the log of a deployment, or a folder of them")
    logs = []
    for file in files:
        log, span = replace(read_log(file), force=None), policy_span(file)
        logs.append(without_rest(log if span is None else beginning(log, span)))
    return tuple(logs)


def read_log(path: Path) -> Recording:
    """Read one log that the folder around it lists."""
    for entry in read_entries(path.parent):
        if path.parent / entry.file == path:
            return read_recording(path.parent, entry)
    raise InvalidDataset(
        f"{path}: a log must be listed in {path.parent / 'dataset.toml'}, as `tendon-newton "
        "deploy` lists it; it is not"
    )


def without_rest(recording: Recording) -> Recording:
    """Return a recording without the rest at its end; all of it where nothing ever moves."""
    way = np.abs(recording.motor_position - recording.motor_position[-1]).max(axis=1)
    moving = np.flatnonzero(way > REST)
    if not moving.size:
        return recording
    return beginning(recording, float(recording.time[moving[-1]] - recording.time[0]) + SETTLING)


def log_files(paths: Sequence[Path]) -> tuple[Path, ...]:
    """Return the files behind some logs, in order.

    Raises:
        InvalidDataset: A log is not there.
    """
    files: list[Path] = []
    for path in paths:
        files += [path / entry.file for entry in read_entries(path)] if path.is_dir() else [path]
    for file in files:
        if not file.is_file():
            raise InvalidDataset(f"{file}: no such log of a deployment")
    return tuple(files)


def logs_as_dataset(path: Path, recordings: Sequence[Recording], loose: float = LOOSE) -> Dataset:
    """Return logs as a dataset whose test split is the end of each; their beginnings are left out.

    A run begins at home, where a tendon may hang loose and the servo turns without the finger; rows
    of later visits there are left out too.

    Args:
        path: Where the logs come from.
        loose: Motor angle up to which the tendon may hang loose [rad].
    """
    train, test = cut(recordings)
    return Dataset(path=path, train=taut_parts(train, loose), test=taut_parts(test, loose))


def fitted_parts(recordings: Sequence[Recording]) -> tuple[Recording, ...]:
    """Return what may be fitted of logs, loose rows included: no beginning and no held-out end."""
    return cut(recordings)[0]


def cut(recordings: Sequence[Recording]) -> tuple[tuple[Recording, ...], tuple[Recording, ...]]:
    """Return what may be fitted of logs and what only reports, without their beginnings."""
    return hold_out([without_beginning(recording) for recording in recordings], HELD_OUT)


def taut_parts(recordings: Sequence[Recording], loose: float = LOOSE) -> tuple[Recording, ...]:
    """Return the parts of recordings in which all tendons are taut; all of them if there is none.

    How far a motor turns back while its tendon hangs loose says nothing of the finger.
    """
    parts: list[Recording] = []
    for recording in recordings:
        taut = np.all(recording.motor_position > loose, axis=1)
        changes = np.flatnonzero(np.diff(np.r_[False, taut, False].astype(np.int8)))
        parts += [
            rows_of(recording, slice(int(first), int(end)), recording.name)
            for first, end in changes.reshape(-1, 2)
            if recording.time[end - 1] - recording.time[first] >= LEAST_PART
        ]
    return tuple(parts) or tuple(recordings)


def without_beginning(recording: Recording) -> Recording:
    """Return a log from `BEGINNING` on."""
    row = int(np.searchsorted(recording.time, recording.time[0] + BEGINNING))
    if row >= recording.sample_count - 2:
        raise InvalidDataset(
            f"{recording.name}: a log must be longer than its beginning of {BEGINNING:g} s; it "
            f"lasts {recording.duration:.1f} s"
        )
    return rows_of(recording, slice(row, recording.sample_count), recording.name)
