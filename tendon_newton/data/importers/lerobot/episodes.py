"""Episodes of a LeRobotDataset as recordings of all its joints, and what is wrong with the rest."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from tendon_newton.data.checks.finding import Examined, Finding
from tendon_newton.data.checks.measures import rows_text
from tendon_newton.data.importers.lerobot.info import JointPlace, LeRobotInfo
from tendon_newton.data.importers.lerobot.lerobot_rows import LeRobotRows
from tendon_newton.data.recording import SERVO, Array, Mask, Recording
from tendon_newton.errors import InvalidRecording, TendonNewtonError, listed

LEAST_ALIKE = 3  # Episodes of one length from which that is the length of all
LEAST_ROWS = 2
RATE_NEAR = 1.2  # [1] by which the rate of stamps may miss what was asked for
MISSING_SHARE = 0.2  # Share of its rows from which an episode is told to be cut [1]


@dataclass(frozen=True, kw_only=True)
class Episode:
    """One episode."""

    number: int
    whole: Recording  # All joints beside each other, in the order of the places that were asked for

    @property
    def name(self) -> str:
        """Its name in a file."""
        return f"episode_{self.number:03d}"


def read_episodes(
    folder: Path, rows: LeRobotRows, joints: Mapping[JointPlace, float], least: int = LEAST_ROWS
) -> tuple[list[Episode], dict[int, str]]:
    """Make a recording of each episode.

    Args:
        joints: Size of each joint's unit [rad].
        least: Rows below which an episode is none.

    Returns:
        The episodes, and of each that makes no recording the reason.

    Raises:
        InvalidRecording: None does.
    """
    episodes: list[Episode] = []
    unusable: dict[int, str] = {}
    for number in map(int, np.unique(rows.episode)):
        chosen = rows.episode == number
        try:
            if chosen.sum() < least:
                raise InvalidRecording(f": must have {least} rows; it has {chosen.sum()}")
            episodes.append(Episode(number=number, whole=whole(number, rows, joints, chosen)))
        except TendonNewtonError as error:
            unusable[number] = str(error).partition(": ")[2]
    if not episodes:
        number, why = next(iter(unusable.items()))
        raise InvalidRecording(f"{folder}: no episode makes a recording; episode {number}: {why}")
    return episodes, unusable


def whole(
    number: int, rows: LeRobotRows, joints: Mapping[JointPlace, float], chosen: Mask
) -> Recording:
    """Return the rows of an episode as a recording of all joints, its speeds the angles' slopes."""
    name, time = f"episode_{number:03d}.csv", rows.time[chosen]
    both = np.concatenate([rows.command[chosen], rows.state[chosen]], axis=1)
    lost: Mask = np.asarray(~np.isfinite(both).all(axis=1))
    if lost.any():
        raise InvalidRecording(
            f"{name}: action and observation.state must be finite; {rows_text(lost, time)} are "
            "not: leave those rows out, or the episode"
        )
    position = columns_of(rows.state[chosen], {p.state: size for p, size in joints.items()})
    command = columns_of(rows.command[chosen], {p.command: size for p, size in joints.items()})
    recording = Recording(
        name=name,
        bench=SERVO,
        time=time,
        command=command,
        motor_position=position,
        motor_velocity=np.zeros_like(position),
        start="first_row",
    )
    slope = np.gradient(position, time, axis=0)
    return replace(recording, motor_velocity=slope)


def columns_of(table: Array, sizes: Mapping[int, float]) -> Array:
    """Return some columns of a table, each times a size, (T, J) of (T, N)."""
    return np.stack([size * table[:, place] for place, size in sizes.items()], axis=1)


def incomplete(info: LeRobotInfo, rows: LeRobotRows) -> Iterator[Finding]:
    """Say which episodes lack rows, by their frames, by the dataset's own count, by each other."""
    numbers, counts = np.unique(rows.episode, return_counts=True)
    cut: dict[int, str] = {}
    for number, count in zip(numbers, counts, strict=True):
        frames = None if rows.frame is None else rows.frame[rows.episode == number]
        if frames is not None and frames[0] > 0:
            cut[int(number)] = f"begins at frame {int(frames[0])}"
        elif frames is not None and frames[-1] + 1 - count > MISSING_SHARE * count:
            cut[int(number)] = f"has {count} of {int(frames[-1]) + 1} frames"
        elif (promised := info.lengths.get(int(number))) is not None and promised != count:
            cut[int(number)] = f"has {count} rows, and meta/episodes says {promised}"
    usual = int(np.median(counts))
    if np.sum(counts == usual) >= max(LEAST_ALIKE, 0.5 * len(counts)):
        for number, count in zip(numbers, counts, strict=True):
            if count < (1.0 - MISSING_SHARE) * usual:
                cut.setdefault(int(number), f"has {count} rows, and most others {usual}")
    for number, evidence in cut.items():
        yield Examined(f"episode_{number:03d}.csv", "t").defect(
            evidence, "a part of the episode is missing: record it anew, or leave it out"
        )
    lost = info.rows is not None and not cut and info.rows != len(rows.time)
    if lost or (info.episodes is not None and info.episodes != len(numbers)):
        counts_said = {"episodes": info.episodes, "rows": info.rows}
        there = listed(str(int(number)) for number in numbers)
        promised = " with ".join(f"{n} {what}" for what, n in counts_said.items() if n is not None)
        yield Examined("all", "t").defect(
            f"{len(numbers)} episodes with {len(rows.time)} rows ({there}), and "
            f"meta/info.json says {promised}",
            "files of rows are missing: download or record the dataset anew",
        )


def misstated_rate(info: LeRobotInfo, rows: LeRobotRows) -> Iterator[Finding]:
    """Say that stamps come at another rate than the dataset states."""
    within = np.diff(rows.time)[np.diff(rows.episode) == 0]
    step = float(np.median(within)) if within.size else 0.0
    if step > 0.0 and not 1.0 / RATE_NEAR < step * info.rate < RATE_NEAR:
        yield Examined("all", "t").defect(
            f"stamps come at {1.0 / step:.3g} Hz, and meta/info.json says fps = {info.rate:g}",
            "delays and speeds are wrong by as much if the stamps are: correct timestamp or fps",
        )
