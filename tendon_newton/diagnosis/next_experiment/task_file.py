"""The user's task: the run that a model shall predict."""

from pathlib import Path

import numpy as np

from tendon_newton.data.excitations import DESIGNED, LARGEST_COMMAND
from tendon_newton.data.formats.any_file import read_recording_file
from tendon_newton.data.formats.csv_columns import read_columns
from tendon_newton.diagnosis.explanation import Setting
from tendon_newton.diagnosis.next_experiment.designed_command import RUN_LENGTHS
from tendon_newton.diagnosis.next_experiment.separation import Plan
from tendon_newton.errors import InvalidRecording

PROMISE = "a task is a recording, or a CSV file with the columns t [s] and theta_d [rad]"


def read_task(path: Path, setting: Setting) -> Plan:
    """Read a recording, of which only the command counts, or a command file.

    Args:
        path: A .csv file with ``t`` and ``theta_d``, or another recording.
        setting: The bench on which it is to be predicted.

    Raises:
        InvalidRecording: It has no such command, or one that the servo's range does not hold.
    """
    if path.suffix == ".csv":
        columns = read_columns(path, str(path))
        time, command = columns.get("t"), columns.get("theta_d")
    else:
        recording = read_recording_file(path, bench=setting.bench, name=str(path))
        time = recording.time
        command = None if recording.command is None else recording.command[:, 0]
    if time is None or command is None or not np.isfinite([time, command]).all():
        raise InvalidRecording(f"{path}: {PROMISE}; one of them is missing, or not a number")
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
