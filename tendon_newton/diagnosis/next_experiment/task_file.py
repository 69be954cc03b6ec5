"""The user's task: the run that a model shall predict."""

import csv
from io import StringIO
from pathlib import Path

import numpy as np

from tendon_newton.data.excitations import DESIGNED, LARGEST_COMMAND
from tendon_newton.data.files.text_file import read_text
from tendon_newton.data.formats.any_file import read_recording_file
from tendon_newton.data.recording import Array
from tendon_newton.diagnosis.explanation import Setting
from tendon_newton.diagnosis.next_experiment.designed_command import RUN_LENGTHS
from tendon_newton.diagnosis.next_experiment.planned_runs import Plan
from tendon_newton.errors import InvalidRecording, shown

PROMISE = "a task is a recording, or a CSV file with the columns t [s] and theta_d [rad]"
SIZE_LIMIT = 1 << 22  # Bytes of a command file at most


def read_task(path: Path, setting: Setting) -> Plan:
    """Read a recording, of which only the command counts, or a command file.

    Args:
        path: A .csv file with ``t`` and ``theta_d``, or another recording.
        setting: The bench on which it is to be predicted.

    Raises:
        InvalidRecording: It has no such command, or one that the servo's range does not hold.
    """
    if path.suffix == ".csv":
        time, command = command_file(path)
    else:
        recording = read_recording_file(path, bench=setting.bench, name=str(path))
        if recording.command is None:
            raise InvalidRecording(f"{path}: {PROMISE}; this recording has no command")
        time, command = recording.time, recording.command[:, 0]
    shortest, longest = RUN_LENGTHS
    if not (np.diff(time) > 0.0).all() or not shortest <= np.ptp(time) <= longest:
        raise InvalidRecording(
            f"{path}: the times of a task increase over {shortest:g} to {longest:g} s; these last "
            f"{np.ptp(time):.3g} s"
        )
    if command.min() < 0.0 or command.max() > LARGEST_COMMAND:
        raise InvalidRecording(
            f"{path}: commands of a task are 0 to {LARGEST_COMMAND:.3f} rad; these are "
            f"{command.min():.3f} to {command.max():.3f}"
        )
    return Plan(setting=setting, excitation=DESIGNED, time=time - time[0], command=command)


def command_file(path: Path) -> tuple[Array, Array]:
    """Return times [s] and commands [rad] of a CSV file, shape (T,) each."""
    text = read_text(path, InvalidRecording, PROMISE, size_limit=SIZE_LIMIT)
    try:
        rows = [(float(row["t"]), float(row["theta_d"])) for row in csv.DictReader(StringIO(text))]
    except (KeyError, TypeError, ValueError, csv.Error) as error:
        raise InvalidRecording(f"{path}: {PROMISE}; {shown(str(error))} is none") from error
    table = np.array(rows).reshape(-1, 2)
    if len(table) < 2 or not np.isfinite(table).all():
        raise InvalidRecording(f"{path}: {PROMISE}, two rows at least; it has {len(table)}")
    return table[:, 0], table[:, 1]
