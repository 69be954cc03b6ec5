"""Logs of any door, with all joints beside each other and no bench stated."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from tendon_newton.data.checks.finding import Finding
from tendon_newton.data.checks.lint import lint_dataset, lint_recording
from tendon_newton.data.dataset import FILE_NAME
from tendon_newton.data.formats.any_file import read_recording_file
from tendon_newton.data.importers.column_mapping import read_mapping
from tendon_newton.data.importers.lerobot.episodes import read_episodes
from tendon_newton.data.importers.lerobot.hub import local_folder
from tendon_newton.data.importers.lerobot.info import INFO
from tendon_newton.data.importers.lerobot.reading import (
    named_joints,
    numbers_of_joints,
    read_joints,
)
from tendon_newton.data.importers.lerobot.units import LeRobotUnits, angle_sizes
from tendon_newton.data.importers.mapped import SERVO, find_logs, read_log
from tendon_newton.data.importers.own import read_own
from tendon_newton.data.recording import Recording
from tendon_newton.errors import InvalidRecording

LEAST_ROWS = 60  # Of an episode that is looked at


@dataclass(frozen=True, kw_only=True)
class ReadLog:
    """What a log holds."""

    recordings: tuple[Recording, ...]  # Of all joints
    joints: tuple[str, ...]
    findings: tuple[Finding, ...]  # Of the checks that import, doctor and diagnose share


def read_any_log(name: str, mapping: Path | None, units: LeRobotUnits) -> ReadLog:
    """Read a log: a dataset of ours, a file or bag, a LeRobotDataset, or what a mapping explains.

    Args:
        name: Path, or id of the Hub.
        mapping: Says which of a log's columns or topics is which of ours; None where it is ours.
        units: What a LeRobotDataset's numbers mean.

    Raises:
        InvalidRecording: It is no log, it is damaged, or it has no commands.
        InvalidDataset: It is a folder with a damaged list of recordings.
        InvalidMapping: The mapping is none, or not made for this log.
    """
    path = Path(name)
    if mapping is not None:
        return mapped_log(path, mapping)
    path = local_folder(name)
    if (path / INFO).is_file():
        return lerobot_log(path, units)
    if (path / FILE_NAME).is_file():
        own = read_own(path)
        return with_joints((*own.train, *own.test), own.findings)
    if not path.exists():
        raise InvalidRecording(f"{name}: no such file, folder or dataset of the Hub")
    recording = read_recording_file(path, bench=SERVO, name=path.name)
    return with_joints((recording,), looked_at((recording,)))


def mapped_log(path: Path, mapping_file: Path) -> ReadLog:
    """Read a file, or the files of a folder, that a mapping explains."""
    mapping = read_mapping(mapping_file)
    if not path.exists():
        raise InvalidRecording(f"{path}: no such file or folder")
    alone = path.is_file() or (path / "metadata.yaml").is_file()
    folder = path.parent if alone else path
    paths = [path] if alone else find_logs(folder, mapping)
    read = [read_log(folder, one, mapping, mend=False) for one in paths]
    recordings = tuple(log.recording for logs, _ in read for log in logs)
    found = tuple(one for _, told in read for one in told)
    return with_joints(recordings, (*found, *looked_at(recordings)), mapping.joints)


def lerobot_log(folder: Path, units: LeRobotUnits) -> ReadLog:
    """Read the episodes of a LeRobotDataset."""
    info, rows = read_joints(folder)
    sizes = angle_sizes(units, numbers_of_joints(rows, info.joints))
    places = {place: sizes[place.name] for place in info.joints}
    episodes, _ = read_episodes(folder, rows, places, LEAST_ROWS)
    recordings = tuple(episode.whole for episode in episodes)
    found = tuple(named_joints(one, info.joints) for one in looked_at(recordings))
    return with_joints(recordings, found, tuple(place.name for place in info.joints))


def looked_at(recordings: Sequence[Recording]) -> tuple[Finding, ...]:
    """Return what the checks find."""
    alone = [one for recording in recordings for one in lint_recording(recording)]
    return (*alone, *lint_dataset(recordings, ()))


def with_joints(
    recordings: Sequence[Recording], findings: Sequence[Finding], names: Sequence[str] = ()
) -> ReadLog:
    """Return recordings with the names of their joints, refusing those that nothing commands."""
    for recording in recordings:
        if recording.command is None:
            raise InvalidRecording(
                f"{recording.name}: a log of commands and angles is needed; it has no theta_d"
            )
    count = max(recording.tendon_count for recording in recordings)
    joints = tuple(names) or (
        ("servo",) if count == 1 else tuple(f"servo_{k}" for k in range(count))
    )
    wrong = [one for one in findings if one.severity != "note"]
    return ReadLog(recordings=tuple(recordings), joints=joints, findings=tuple(wrong))
