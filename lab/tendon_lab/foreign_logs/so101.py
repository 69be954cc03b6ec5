"""Logs of the six Feetech STS3215 servos of an SO-101 arm, one folder per motion.

A folder holds ``joint_list.txt``, ``control.csv`` (``timestamp`` us, ``positions`` rad) and
``state_motor.csv`` (``timestamp``, ``positions``, ``velocities`` rad/s, ``torques``); a cell with
brackets lists one number per joint. Every joint of every motion becomes one recording of the bench
``servo``. Source of the format: isaac-sim2real/sage.
"""

from __future__ import annotations

import csv
import json
from array import array
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from tendon_lab.foreign_logs.so101_findings import COUNT, folder_findings, shaft_turns, stops
from tendon_newton.data.files.origin import content_hash
from tendon_newton.data.files.text_file import (
    LOG_SIZE_LIMIT,
    SIZE_LIMIT,
    finite_number,
    open_text,
    read_text,
)
from tendon_newton.data.files.values import is_list
from tendon_newton.data.importers.imported import Imported, ImportedLog
from tendon_newton.data.model_file import Model, NamedValues
from tendon_newton.data.recording import Array, Recording
from tendon_newton.errors import InvalidRecording, TendonNewtonError, listed, shown

MICROSECOND = 1.0e-6  # [s]
TORQUE_UNIT = 0.022814  # ``torques`` per count of the current register, as the source states it
CURRENT_UNIT = 6.5e-3  # [A] one count of the STS3215's current register (Feetech memory table)
# LeRobot's `configure_motors` sets the register Acceleration of each servo to 254, whose unit is
# 100 counts/s^2 (Feetech memory table); sweeps of the real arm show it (docs/lab/so101.md)
GOAL_ACCELERATION = 254 * 100.0 * COUNT  # [rad/s2]
UNREACHED = 100.0  # [rad/s] a goal's speed that no motion reaches: the register is left alone
FILES = ("joint_list.txt", "control.csv", "state_motor.csv")
COLUMNS = {"control.csv": ("positions",), "state_motor.csv": ("positions", "velocities", "torques")}


def read_so101(folder: Path) -> Imported:
    """Read every motion of a folder."""
    if not folder.is_dir():
        came = "it is a file" if folder.exists() else "no such folder"
        raise InvalidRecording(f"{folder}: SO-101 logs come as one folder per motion; {came}")
    motions = sorted(path.parent for path in folder.glob("*/state_motor.csv"))
    if not motions:
        raise InvalidRecording(
            f"{folder}: SO-101 logs come as one folder per motion with {', '.join(FILES)}; "
            "no folder here holds state_motor.csv"
        )
    logs = [log for motion in motions for log in read_motion(motion)]
    found = [finding for log in logs for finding in stops(log)]
    return Imported(
        logs=tuple(logs),
        start_model=start_model_of,
        limits={},
        findings=(*found, *folder_findings(logs)),
        split_by="joint",
    )


def start_model_of(logs: Sequence[ImportedLog]) -> Model:
    """Return a servo that is where it was told to be, behind what LeRobot writes to it.

    A joint whose logged radians are not its shaft's has another acceleration in them; of several
    joints that of most counts.
    """
    joints = dict.fromkeys(log.conditions["joint"] for log in logs)
    turns = [
        shaft_turns([log.recording for log in logs if log.conditions["joint"] == joint])
        for joint in joints
    ]
    values = {"limit": GOAL_ACCELERATION / float(np.median(turns)), "speed": UNREACHED}
    return Model(
        actuator=NamedValues(name="ideal_position", values={}),
        effects=(NamedValues(name="acceleration_limit", values=values),),
        tolerances={"acceleration_limit": 0.0},  # a register holds it
    )


def read_motion(folder: Path) -> list[ImportedLog]:
    """Read one motion: a log per joint."""
    for name in FILES:
        if not (folder / name).is_file():
            raise InvalidRecording(
                f"{folder}: an SO-101 motion holds {', '.join(FILES)}; no {name}"
            )
    promise = "a list of joints is a text file"
    text = read_text(folder / "joint_list.txt", InvalidRecording, promise, size_limit=SIZE_LIMIT)
    joints = text.split()
    if not joints:
        raise InvalidRecording(f"{folder}: joint_list.txt must name the joints; it names none")
    control = read_table(folder / "control.csv", len(joints))
    state = read_table(folder / "state_motor.csv", len(joints))
    if not np.array_equal(control["timestamp"], state["timestamp"]):
        raise InvalidRecording(
            f"{folder}: control.csv and state_motor.csv must have the same timestamps; they have "
            f"{len(control['timestamp'])} and {len(state['timestamp'])} rows that differ"
        )
    digest = content_hash(b"".join((folder / name).read_bytes() for name in FILES))
    return [
        ImportedLog(
            recording=joint_recording(folder.name, joint, j, control, state),
            conditions={"motion": folder.name, "joint": joint},
            source=folder / joint,
            sha256=digest,
        )
        for j, joint in enumerate(joints)
    ]


def joint_recording(
    motion: str, joint: str, j: int, control: dict[str, Array], state: dict[str, Array]
) -> Recording:
    """Make the recording of joint j of a motion."""
    counts = np.round(state["torques"][:, j] / TORQUE_UNIT)
    name = f"{joint}_{motion}.csv"
    try:
        return Recording(
            name=name,
            bench="servo",
            time=state["timestamp"] * MICROSECOND,
            command=control["positions"][:, j : j + 1],
            motor_position=state["positions"][:, j : j + 1],
            motor_velocity=state["velocities"][:, j : j + 1],
            current=counts * CURRENT_UNIT,
            start="first_row",
        )
    except TendonNewtonError as error:
        raise InvalidRecording(f"{motion}, joint {joint}: {error}") from error


def read_table(path: Path, joints: int) -> dict[str, Array]:
    """Read a file's time stamps, shape (T,), and its lists of numbers, shape (T, joints)."""
    promise = "a log of an SO-101 is a CSV file"
    with open_text(path, InvalidRecording, promise, size_limit=LOG_SIZE_LIMIT) as file:
        try:
            return read_cells(path, csv.DictReader(file), joints)
        except csv.Error as error:
            raise InvalidRecording(f"{path}: a log must be CSV: {error}") from error


def read_cells(path: Path, reader: csv.DictReader[str], joints: int) -> dict[str, Array]:
    """Read the rows of a table."""
    times = array("d")
    columns = {name: array("d") for name in COLUMNS[path.name]}
    missing = {"timestamp", *columns} - set(reader.fieldnames or ())
    if missing:
        raise InvalidRecording(
            f"{path}: columns {', '.join(sorted(missing))} are missing; there are "
            f"{listed(reader.fieldnames or ())}"
        )
    for row, cells in enumerate(reader):
        times.extend(read_cell(path, row, "timestamp", cells["timestamp"], None))
        for name, column in columns.items():
            column.extend(read_cell(path, row, name, cells[name], joints))
    if not times:
        raise InvalidRecording(f"{path}: a log has rows; this one has none")
    rows = {name: np.frombuffer(column).reshape(-1, joints) for name, column in columns.items()}
    return {"timestamp": np.frombuffer(times), **rows}


def read_cell(
    path: Path, row: int, column: str, text: str | None, count: int | None
) -> list[float]:
    """Read one number, or a list of so many."""
    try:
        value = json.loads(text or "")
    except (ValueError, RecursionError):
        value = None
    items = value if is_list(value) else [value]
    numbers = [finite_number(item) for item in items]
    if isinstance(value, list) == (count is None) or len(items) != (count or 1) or None in numbers:
        expected = "a number" if count is None else f"a list of {count} numbers"
        raise InvalidRecording(f"{path}: {column} must be {expected}; row {row} has {shown(text)}")
    return [number for number in numbers if number is not None]
