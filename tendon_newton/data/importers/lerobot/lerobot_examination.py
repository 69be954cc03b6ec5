"""What is wrong with the joints of a LeRobotDataset, before anybody trains on it."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import pi
from pathlib import Path

import numpy as np

from tendon_newton.data.checks.following import (
    FollowedMotion,
    Following,
    follow,
    held_rows,
    offset_of,
)
from tendon_newton.data.importers.lerobot.info import JointPlace
from tendon_newton.data.importers.lerobot.lerobot_rows import LeRobotRows
from tendon_newton.data.importers.lerobot.reading import AS_TYPED, numbers_of_joints, read_joints
from tendon_newton.data.importers.lerobot.units import DEGREE, GRIPPER, LeRobotUnits, angle_sizes
from tendon_newton.data.recording import Array, Mask
from tendon_newton.errors import InvalidRecording

ANGLE_LIMIT = 5.0 * DEGREE
"""Offset or play from which on a joint fails; a sound SO-101 sags by up to 2.3 degrees and has up
to 4.7 degrees of play (docs/lab/so101.md)."""
LATENESS_LIMIT = 0.2
"""Delay and lag together from which on a joint fails [s]; those of a sound SO-101 are 90 to 120 ms
(docs/lab/so101.md)."""
SHARE_LIMIT = 0.01  # Share of the rows that may be held, late or missing [1]
MOTION_LIMIT = 2.0 * DEGREE  # Motion of a command below which nothing can be told of its joint
MOTION_ROWS = 4000
"""Rows of a joint that are fitted, from the episodes in which it moves most; two minutes."""
LEAST_ROWS = 60  # Rows of an episode below which it is not looked at; two seconds
STRANGE = 0.5  # Share of its motion that a joint may be off what was commanded [1]
HEADINGS = "    offset   delay     lag      play    held  missing  late rows"
"""Columns of a joint's line."""
LATE = 0.25  # Periods by which a late row is late [1]
STEP_LIMIT = 4.0 * 2.0 * pi / 4096.0
"""Motion from row to row beyond which an angle that stays the same was not read anew [rad]."""


@dataclass(frozen=True, kw_only=True)
class JointExamination:
    """What was seen of a joint."""

    joint: str
    size: float  # Size of its unit, about where nobody said [rad]
    following: Following | None  # How it follows; None where it hardly moves
    # Angle beside the command in each episode [rad]; none where it hardly moves
    offsets: tuple[float, ...]
    # Share of the time in which it stands far from its command or falls back: overload, or
    # something solid [1]
    held_share: float
    dropped: int  # Rows that are missing, by the stamps
    late: int  # Rows that came late, by the stamps or because an angle stays the same amid a motion
    faults: tuple[str, ...]  # What fails it, each with what to do; none where it passes

    @property
    def text(self) -> str:
        """Numbers of the joint on one line, under ``HEADINGS``."""
        told = "hardly moves".ljust(34)
        if (found := self.following) is not None:
            told = (
                f"{np.median(self.offsets) / DEGREE:+6.1f} deg {1e3 * found.delay:4.0f} ms "
                f"{1e3 * found.lag:4.0f} ms {found.play / DEGREE:5.1f} deg "
            )
        return f"{told}{100.0 * self.held_share:5.1f} % {self.dropped:8d} {self.late:10d}"


def examine_dataset(folder: Path, units: LeRobotUnits = AS_TYPED) -> tuple[JointExamination, ...]:
    """Examine every joint of a LeRobotDataset.

    Args:
        units: What the joints' numbers mean; degrees where nobody says so and they are no radians.
            A percent of a range is about a degree.

    Raises:
        InvalidRecording: It is no LeRobotDataset, it is damaged, or all its episodes are short.
        MissingDependency: pyarrow is not installed.
    """
    info, rows = read_joints(folder)
    sizes = angle_sizes(units, numbers_of_joints(rows, info.joints))
    episodes = episodes_of(folder, rows)
    faults = [stamp_faults(rows.time[chosen]) for chosen in episodes]
    return tuple(
        examine_joint(
            place.name,
            sizes[place.name],
            motions_of(rows, place, sizes[place.name], episodes),
            dropped=sum(missing for missing, _ in faults),
            late=sum(late for _, late in faults),
        )
        for place in info.joints
    )


def episodes_of(folder: Path, rows: LeRobotRows) -> list[Mask]:
    """Return which rows belong to each episode that is long enough."""
    episodes = [rows.episode == number for number in np.unique(rows.episode)]
    episodes = [chosen for chosen in episodes if chosen.sum() >= LEAST_ROWS]
    if not episodes:
        raise InvalidRecording(
            f"{folder}: some episode must have {LEAST_ROWS} rows to be examined; none has"
        )
    for chosen in episodes:
        if np.any(np.diff(rows.time[chosen]) <= 0.0):
            raise InvalidRecording(
                f"{folder}: timestamp must increase within an episode; it does not in episode "
                f"{int(rows.episode[chosen][0])}"
            )
    return episodes


def motions_of(
    rows: LeRobotRows, place: JointPlace, size: float, episodes: Sequence[Mask]
) -> list[FollowedMotion]:
    """Return a joint's episodes."""
    return [
        FollowedMotion(
            time=rows.time[chosen],
            command=size * rows.command[chosen, place.command],
            position=size * rows.state[chosen, place.state],
        )
        for chosen in episodes
    ]


def examine_joint(
    name: str, size: float, motions: Sequence[FollowedMotion], *, dropped: int, late: int
) -> JointExamination:
    """Examine one joint, whose unit has a size [rad]."""
    count = sum(len(motion.time) for motion in motions)
    held = sum(int(held_rows(motion).sum()) for motion in motions) / count
    late += sum(repeated_rows(motion.position) for motion in motions)
    fitted = moving(motions)
    following = follow(fitted) if fitted else None
    offsets = [] if following is None else [offset_of(motion, following) for motion in motions]
    faults = [] if following is None else list(following_faults(following, offsets))
    faults += row_faults(name, held, dropped, late, count)
    return JointExamination(
        joint=name,
        size=size,
        following=following,
        offsets=tuple(offsets),
        held_share=held,
        dropped=dropped,
        late=late,
        faults=tuple(faults),
    )


def moving(motions: Sequence[FollowedMotion]) -> list[FollowedMotion]:
    """Return the episodes in which a joint moves most, up to so many rows."""
    usable = [motion for motion in motions if np.ptp(motion.command) > MOTION_LIMIT]
    chosen: list[FollowedMotion] = []
    for motion in sorted(usable, key=lambda motion: -float(np.ptp(motion.command))):
        if sum(len(other.time) for other in chosen) < MOTION_ROWS:
            chosen.append(cut(motion))
    return chosen


def cut(motion: FollowedMotion) -> FollowedMotion:
    """Return the first rows of a long motion."""
    rows = slice(MOTION_ROWS)
    return FollowedMotion(
        time=motion.time[rows], command=motion.command[rows], position=motion.position[rows]
    )


def following_faults(following: Following, offsets: Sequence[float]) -> Iterator[str]:
    """Say what fails a joint in how it follows."""
    if following.residual > STRANGE * following.motion:
        yield (
            f"does not follow its command, by {following.residual / DEGREE:.1f} deg RMS: action "
            "must hold the goal of the same joint in the same unit"
        )
        return
    offset = float(np.median(offsets))
    if abs(offset) > ANGLE_LIMIT:
        yield (
            f"reads {offset / DEGREE:+.1f} deg beside its command: calibrate leader and follower "
            "anew, or subtract it from observation.state"
        )
    apart = np.abs(np.array(offsets) - offset)
    if apart.max() > ANGLE_LIMIT:
        worst = int(np.argmax(apart))
        yield (
            f"reads {offsets[worst] / DEGREE:+.1f} deg beside its command in the episode in place "
            f"{worst}, {offset / DEGREE:+.1f} deg in most: it was calibrated in between, a horn "
            "slips, or its load changes"
        )
    lateness = following.delay + following.lag
    if lateness > LATENESS_LIMIT:
        yield (
            f"follows {1e3 * lateness:.0f} ms late: look at the loop's rate, the bus and the "
            "servo's gain and acceleration registers"
        )
    if following.play > ANGLE_LIMIT:
        yield (
            f"has {following.play / DEGREE:.1f} deg of play: tighten horn and screws, or replace a "
            "worn gear"
        )


def row_faults(joint: str, held: float, dropped: int, late: int, count: int) -> Iterator[str]:
    """Say what fails a joint in its rows; a gripper may hold what it grasps."""
    if held > SHARE_LIMIT and GRIPPER not in joint:
        yield (
            f"is held short of its command in {100.0 * held:.0f} % of the time: overload, or "
            "something solid; lighten the load or leave those episodes out"
        )
    for rows, word in ((dropped, "missing"), (late, "late")):
        if rows > SHARE_LIMIT * count:
            yield f"{rows} of {count} rows are {word}: the recording computer was too slow"


def stamp_faults(time: Array) -> tuple[int, int]:
    """Return how many rows of an episode are missing and how many came late, by their stamps."""
    steps = np.diff(time) / np.median(np.diff(time))
    over, made_up = steps - 1.0, np.r_[np.maximum(0.0, 1.0 - steps[1:]), 0.0]
    missing = np.rint(np.maximum(0.0, over - made_up))
    return int(np.sum(missing)), int(np.sum((over > LATE) & (missing == 0.0)))


def repeated_rows(position: Array) -> int:
    """Count rows whose angle is that of the row before although the joint moves on either side."""
    steps = np.diff(position)
    before, after = steps[:-2], steps[2:]
    again = (steps[1:-1] == 0.0) & (np.minimum(abs(before), abs(after)) > STEP_LIMIT)
    return int(np.sum(again & (before * after > 0.0)))
