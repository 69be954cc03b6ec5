"""From a LeRobotDataset's folder to recordings, joint by joint and episode by episode."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from tendon_newton.data.checks.command_checks import exchanges
from tendon_newton.data.checks.finding import Examined, Finding
from tendon_newton.data.dataset import refuse_own
from tendon_newton.data.files.origin import content_hash
from tendon_newton.data.importers.imported import Imported, ImportedLog
from tendon_newton.data.importers.lerobot.episodes import (
    Episode,
    incomplete,
    misstated_rate,
    read_episodes,
)
from tendon_newton.data.importers.lerobot.info import (
    COMMAND,
    INFO,
    STATE,
    JointPlace,
    LeRobotInfo,
    read_info,
)
from tendon_newton.data.importers.lerobot.lerobot_rows import LeRobotRows, read_rows
from tendon_newton.data.importers.lerobot.units import LeRobotUnits, sizes_of
from tendon_newton.data.importers.mapped import of_servo
from tendon_newton.data.model_file import Model, NamedValues
from tendon_newton.data.recording import Array
from tendon_newton.errors import InvalidRecording, listed

GRID = 1.0e-4
"""Share of a period within which a stamp is a whole number of periods [1]; single precision."""
AS_TYPED = LeRobotUnits()


IN_WORDS = {
    r"\btheta\b": STATE,
    r"\btheta_d\b": COMMAND,
    r'say unit = "\w+" for it in the mapping': "write both in one unit",
    r" \([^();]* in the mapping\)": "",
    r"sign = -1 in the mapping; ": "",
}
"""How findings call things -> how a LeRobotDataset does, which has no mapping."""


def read_lerobot(folder: Path, units: LeRobotUnits = AS_TYPED) -> Imported:
    """Read every episode of a folder.

    Raises:
        InvalidRecording: It is no LeRobotDataset, or it is damaged.
        InvalidParameter: The unit is not known.
        MissingDependency: pyarrow is not installed.
    """
    info, rows = read_joints(folder)
    joints = info.joints
    sizes = sizes_of(units, numbers_of_joints(rows, joints))
    digest = content_hash((folder / INFO).read_bytes() + rows.state.tobytes())
    kept = [place for place in joints if place.name in sizes]
    if not kept:
        raise InvalidRecording(
            f"{folder}: {listed(place.name for place in joints)} is in percent of a range that "
            "only a calibration file tells: --calibration FILE"
        )
    episodes, unusable = read_episodes(folder, rows, {place: sizes[place.name] for place in kept})
    return Imported(
        logs=tuple(logs_of(folder, kept, episodes, digest)),
        start_model=lambda _: Model(actuator=NamedValues(name="ideal_position", values={})),
        limits={},
        findings=(
            *findings_of(info, rows, joints, kept),
            *episode_findings(info, rows, unusable),
            *(one for episode in episodes for one in exchanges_in(episode, kept)),
        ),
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
    refuse_own(folder)
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


def logs_of(
    folder: Path, joints: Sequence[JointPlace], episodes: Sequence[Episode], digest: str
) -> Iterator[ImportedLog]:
    """Make the recordings of all joints, one per episode."""
    for place, joint in enumerate(joints):
        for episode in episodes:
            name = f"{joint.name}_{episode.name}"
            yield ImportedLog(
                recording=replace(of_servo(episode.whole, place), name=f"{name}.csv"),
                conditions={"episode": float(episode.number), "joint": joint.name},
                source=folder / name,
                sha256=digest,
            )


def exchanges_in(episode: Episode, joints: Sequence[JointPlace]) -> Iterator[Finding]:
    """Say which joints of an episode follow each other's commands, in their own recordings."""
    for place, finding in exchanges(episode.whole, [joint.name for joint in joints]):
        own = f"{joints[place].name}_{episode.name}.csv"
        yield replace(named_joints(finding, joints), recording=own)


def named_joints(finding: Finding, joints: Sequence[JointPlace]) -> Finding:
    """Return a finding that calls joints by their names, and columns as LeRobot does."""

    def named(text: str) -> str:
        text = re.sub(r"\btheta_(\d+)\b", lambda found: joints[int(found[1])].name, text)
        for ours, theirs in IN_WORDS.items():
            text = re.sub(ours, theirs, text)
        return text

    return replace(
        finding, evidence=named(finding.evidence), consequence=named(finding.consequence)
    )


def episode_findings(
    info: LeRobotInfo, rows: LeRobotRows, unusable: Mapping[int, str]
) -> Iterator[Finding]:
    """Say which episodes make no recording, and which lack a part."""
    for number, why in unusable.items():
        yield Examined("all", "t").defect(
            f"episode {number}: {why}", "this episode is left out: record it anew"
        )
    yield from misstated_rate(info, rows)
    for finding in incomplete(info, rows):
        yield replace(finding, recording="all", evidence=f"{finding.recording}: {finding.evidence}")


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
