"""From a LeRobotDataset's folder to recordings, joint by joint and episode by episode."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from tendon_newton.data.checks.finding import Examined, Finding
from tendon_newton.data.files.origin import content_hash
from tendon_newton.data.importers.imported import Imported, ImportedLog
from tendon_newton.data.importers.lerobot.info import INFO, JointPlace, LeRobotInfo, read_info
from tendon_newton.data.importers.lerobot.lerobot_rows import LeRobotRows, read_rows
from tendon_newton.data.importers.lerobot.units import LeRobotUnits, sizes_of
from tendon_newton.data.model_file import Model, NamedValues
from tendon_newton.data.recording import Array, Recording
from tendon_newton.errors import InvalidRecording, TendonNewtonError, listed, unknown_name

LEAST_ROWS = 2
GRID = 1.0e-4
"""Share of a period within which a stamp is a whole number of periods [1]; single precision."""
AS_TYPED = LeRobotUnits()


def read_lerobot(
    folder: Path, joint: str | None = None, units: LeRobotUnits = AS_TYPED
) -> Imported:
    """Read every episode of a folder.

    Args:
        joint: The only joint to read; all of them unless given.

    Raises:
        InvalidRecording: It is no LeRobotDataset, or it is damaged.
        InvalidParameter: The unit is not known.
        UnknownName: No such joint; the message lists the known ones.
        MissingDependency: pyarrow is not installed.
    """
    info, rows = read_joints(folder)
    joints = [place for place in info.joints if joint in (None, place.name)]
    if not joints:
        raise unknown_name("joint", str(joint), [place.name for place in info.joints])
    sizes = sizes_of(units, numbers_of_joints(rows, joints))
    digest = content_hash((folder / INFO).read_bytes() + rows.state.tobytes())
    kept = [place for place in joints if place.name in sizes]
    if not kept:
        raise InvalidRecording(
            f"{folder}: {listed(place.name for place in joints)} is in percent of a range that "
            "only a calibration file tells: --calibration FILE"
        )
    logs = [
        log for place in kept for log in joint_logs(folder, place, rows, sizes[place.name], digest)
    ]
    return Imported(
        logs=tuple(logs),
        start_model=lambda _: Model(actuator=NamedValues(name="ideal_position", values={})),
        limits={},
        findings=tuple(findings_of(info, rows, joints, kept)),
        split_by="joint",
    )


def read_joints(folder: Path) -> tuple[LeRobotInfo, LeRobotRows]:
    """Read what a folder says of its joints, and its rows.

    Raises:
        InvalidRecording: It is no LeRobotDataset, or it is damaged.
        MissingDependency: pyarrow is not installed.
    """
    if not folder.is_dir():
        came = "it is a file" if folder.exists() else "no such folder"
        raise InvalidRecording(f"{folder}: a LeRobotDataset is a folder with {INFO}; {came}")
    info = read_info(folder)
    rows = read_rows(folder)
    for place in info.joints:
        if place.command >= rows.command.shape[1] or place.state >= rows.state.shape[1]:
            raise InvalidRecording(
                f"{folder}: {INFO} names more joints than a row has: {rows.command.shape[1]} "
                f"commanded, {rows.state.shape[1]} measured"
            )
    return info, rows


def numbers_of_joints(rows: LeRobotRows, joints: Sequence[JointPlace]) -> dict[str, Array]:
    """Return all numbers of each joint, commanded and measured, in the dataset's unit."""
    return {
        place.name: np.concatenate([rows.command[:, place.command], rows.state[:, place.state]])
        for place in joints
    }


def joint_logs(
    folder: Path, place: JointPlace, rows: LeRobotRows, size: float, digest: str
) -> Iterator[ImportedLog]:
    """Make the recordings of a joint, one per episode."""
    for episode in np.unique(rows.episode):
        chosen = rows.episode == episode
        name = f"{place.name}_episode_{int(episode):03d}"
        if chosen.sum() < LEAST_ROWS:
            raise InvalidRecording(
                f"{folder}: an episode has {LEAST_ROWS} rows or more; episode {int(episode)} has "
                f"{chosen.sum()}"
            )
        time = rows.time[chosen]
        position = size * rows.state[chosen, place.state, None]
        try:
            recording = Recording(
                name=f"{name}.csv",
                bench="servo",
                time=time,
                command=size * rows.command[chosen, place.command, None],
                motor_position=position,
                motor_velocity=np.zeros_like(position),
                start="first_row",
            )
            recording = with_slope(recording)
        except TendonNewtonError as error:
            raise InvalidRecording(f"{folder}, {name}: {error}") from error
        yield ImportedLog(
            recording=recording,
            conditions={"episode": float(episode), "joint": place.name},
            source=folder / name,
            sha256=digest,
        )


def with_slope(recording: Recording) -> Recording:
    """Return a recording whose speed is the slope of its position."""
    slope = np.gradient(recording.motor_position, recording.time, axis=0)
    return replace(recording, motor_velocity=slope)


def findings_of(
    info: LeRobotInfo, rows: LeRobotRows, joints: Sequence[JointPlace], kept: Sequence[JointPlace]
) -> Iterator[Finding]:
    """Say what all recordings have in common."""
    periods = rows.time * info.rate
    if np.abs(periods - np.round(periods)).max() < max(GRID, 1e-6 * float(periods.max())):
        yield Examined("all", "t").caution(
            f"every stamp is a whole number of periods of {1e3 / info.rate:g} ms",
            "the stamps are the plan, not a clock's: a row that came late is not seen, "
            "and a delay found here holds up to a row",
        )
    yield Examined("all", "theta_dot").note(
        "no speed was logged", "theta_dot is the slope of theta: it tells nothing of its own"
    )
    if lost := [place.name for place in joints if place not in kept]:
        yield Examined("all", "theta").caution(
            f"{', '.join(lost)}: in percent of a range that no file here states",
            "left out; --calibration FILE, LeRobot's own, brings it back",
        )
