"""Logs of any door, with all joints beside each other and no bench stated."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from tendon_newton.data.checks.finding import Finding
from tendon_newton.data.checks.lint import lint_dataset, lint_recording
from tendon_newton.data.dataset import FILE_NAME, dataset_folders
from tendon_newton.data.formats.any_file import read_recording_file
from tendon_newton.data.formats.mapped_column import OF_A_SERVO
from tendon_newton.data.importers.column_mapping import read_mapping
from tendon_newton.data.importers.lerobot.episodes import read_episodes
from tendon_newton.data.importers.lerobot.hub import local_folder
from tendon_newton.data.importers.lerobot.info import INFO, JointPlace
from tendon_newton.data.importers.lerobot.reading import (
    named_joints,
    numbers_of_joints,
    read_joints,
)
from tendon_newton.data.importers.lerobot.units import LeRobotUnits, angle_sizes
from tendon_newton.data.importers.mapped import find_logs, read_log
from tendon_newton.data.importers.own import read_own
from tendon_newton.data.recording import SERVO, Recording
from tendon_newton.errors import InvalidRecording, listed

LONGEST_HEADER = 4096  # Letters of a first line that are looked at
ANY_OTHER = (
    "Any other log is read with --mapping FILE, which says what its columns are: "
    "docs/oscillation.md has one to copy"
)
LEAST_ROWS = 60  # Of an episode that is looked at
ANGLES = ("theta", "theta_d")
READ = ("t", *ANGLES, "voltage", "enabled")  # Columns of a mapping that are read
UNUSED = ("theta_dot", "force", "current", "temperature", "joint_angle", "joint_load")
"""Columns of which nothing is made here, so that what is wrong with them does not matter."""


@dataclass(frozen=True, kw_only=True)
class ReadLog:
    """What a log holds."""

    recordings: tuple[Recording, ...]  # Of all joints
    joints: tuple[str, ...]
    findings: tuple[Finding, ...]  # Of the checks that import, doctor and diagnose share
    titles: Sequence[JointPlace] = ()  # Joints of a LeRobotDataset, which findings are to name

    def findings_of(self, place: int | None) -> list[Finding]:
        """Return what was found in the columns of a joint; None for what is of no single one."""
        own = [one for one in self.findings if self.place_of(one) == place]
        return [named_joints(one, self.titles) for one in own] if self.titles else own

    def place_of(self, finding: Finding) -> int | None:
        """Return the joint whose column a finding is of; None where it is of no single one."""
        column = OF_A_SERVO.fullmatch(finding.channel)
        if column is not None:
            return int(column[2])
        return 0 if len(self.joints) == 1 and finding.channel in ANGLES else None


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
    if folders := dataset_folders(path):
        raise InvalidRecording(
            f"{name}: holds {len(folders)} datasets, {listed(one.name for one in folders)}; name "
            "one of them"
        )
    bag = path.suffix in (".mcap", ".db3") or (path / "metadata.yaml").is_file()
    if not bag and path.suffix != ".csv":
        raise InvalidRecording(
            f"{name}: a log of ours ends in .csv, .mcap or .db3, or is the folder of a dataset or "
            f"bag. {ANY_OTHER}"
        )
    if not bag and path.is_file() and "t" not in (names := header_of(path)):
        raise InvalidRecording(
            f"{name}: its columns are {listed(names[:8])}; a log of ours has t, theta_d, theta and "
            f"theta_dot. {ANY_OTHER}"
        )
    recording = read_recording_file(path, bench=SERVO, name=path.name)
    return with_joints((recording,), looked_at((recording,)))


def header_of(path: Path) -> list[str]:
    """Return what stands between commas in the first line of a file."""
    with path.open(encoding="utf-8-sig", errors="replace") as file:
        return [cell.strip() for cell in file.readline(LONGEST_HEADER).split(",")]


def mapped_log(path: Path, mapping_file: Path) -> ReadLog:
    """Read a file, or the files of a folder, that a mapping explains."""
    mapping = read_mapping(mapping_file, READ)
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
    found, names = looked_at(recordings), tuple(place.name for place in info.joints)
    return replace(with_joints(recordings, found, names), titles=info.joints)


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
    wrong = [
        replace(one, safe=False)  # nothing is written here, so nothing is mended
        for one in findings
        if one.severity != "note" and one.channel.rstrip("_0123456789") not in UNUSED
    ]
    return ReadLog(recordings=tuple(recordings), joints=joints, findings=tuple(wrong))
