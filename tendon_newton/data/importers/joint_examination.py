"""How the joints of an arm follow their commands, and which of them stand out."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tendon_newton.data.checks.finding import Examined, Finding
from tendon_newton.data.checks.following import FollowedMotion, Following, held_rows, offset_of
from tendon_newton.data.checks.frozen_checks import frozen_rows
from tendon_newton.data.checks.mends import with_signs
from tendon_newton.data.checks.read_checks import repeated_rows, unread_angles
from tendon_newton.data.checks.seam_checks import without_seams
from tendon_newton.data.importers.joint_faults import (
    DEGREE,
    beside_siblings,
    follow_most,
    following_faults,
    follows,
    row_faults,
)
from tendon_newton.data.recording import Array, Mask, Recording

HEADINGS = "    offset   delay     lag      play    held  missing  late rows"
"""Columns of a joint's line."""
PAUSE = 300.0  # Periods in a row that no slow computer loses: the clock was set, or all paused [1]
LATE = 0.25  # Periods by which a late row is late [1]
ROWS_ALONE = ("failed read", "repeated read", "frozen read", "lost sign", "seam")
"""Checks whose rows are left out or mended: the rest still tells how a joint follows."""


@dataclass(frozen=True, kw_only=True)
class JointExamination:
    """What was seen of a joint."""

    joint: str
    # How it follows by its good rows; None where it hardly moves, or they do not tell
    following: Following | None
    # Angle beside the command in each episode [rad]; none where that is not told
    offsets: tuple[float, ...]
    # Share of the time in which it stands far from its command or falls back: overload, or
    # something solid [1]
    held_share: float
    dropped: int  # Rows that are missing, by the stamps
    late: int  # Rows that came late, by the stamps or because an angle stays the same amid a motion
    faults: tuple[Finding, ...]  # What fails it, each with what to do; none where it passes

    @property
    def text(self) -> str:
        """Numbers of the joint on one line, under ``HEADINGS``."""
        told = ("not told" if self.faults else "hardly moves").ljust(34)
        if (found := self.following) is not None:
            told = (
                f"{np.median(self.offsets) / DEGREE:+6.1f} deg {1e3 * found.delay:4.0f} ms "
                f"{1e3 * found.lag:4.0f} ms {found.play / DEGREE:5.1f} deg "
            )
        return f"{told}{100.0 * self.held_share:5.1f} % {self.dropped:8d} {self.late:10d}"


@dataclass(frozen=True, kw_only=True)
class Examination:
    """What was seen of all joints."""

    joints: tuple[JointExamination, ...]
    # What is wrong with all of it, or with whole episodes
    faults: tuple[Finding, ...] = ()
    in_radians: bool = True  # Whether that is what the numbers are in, as they were logged

    @property
    def sound(self) -> bool:
        """Whether nothing is to mend."""
        return not self.faults and not any(joint.faults for joint in self.joints)


def examine_joints(
    wholes: Sequence[Recording], found: Mapping[str, Sequence[Finding]]
) -> tuple[JointExamination, ...]:
    """Examine joints that were logged together, each alone and beside its siblings.

    Args:
        wholes: All joints beside each other, of each motion.
        found: Joint, in their order -> what the checks of recordings say of it.
    """
    signed = [without_seams(with_signs(whole)) for whole in wholes]
    stood = [frozen_rows(whole) for whole in signed]
    joints = [
        examine_joint(
            joint,
            {
                whole.name: motion_of(whole, frozen, place)
                for whole, frozen in zip(signed, stood, strict=True)
            },
            own,
            [whole.motor_position[:, place] for whole in wholes],
        )
        for place, (joint, own) in enumerate(found.items())
    ]
    told = {joint.joint: joint.following for joint in joints if joint.following is not None}
    outstanding = list(beside_siblings(told))
    return tuple(
        replace(
            joint,
            faults=(*joint.faults, *(one for name, one in outstanding if name == joint.joint)),
        )
        for joint in joints
    )


def fails(finding: Finding) -> bool:
    """Tell whether a finding fails a joint."""
    return finding.severity == "defect" or (
        finding.severity == "caution" and finding.check in ("repeated read", "slow read", "degrees")
    )


def motion_of(whole: Recording, frozen: Mask, place: int) -> FollowedMotion:
    """Return one joint of an episode, without the rows in which it was not read or had no torque.

    Args:
        frozen: Rows in which each angle is frozen, shape (T, J).
    """
    assert whole.command is not None
    angles = whole.motor_position
    bad = unread_angles(whole, place) | repeated_rows(angles[:, place]) | frozen[:, place]
    time, read = whole.time[~bad], angles[~bad, place]
    return FollowedMotion(
        time=whole.time,
        command=whole.command[:, place],
        position=np.interp(whole.time, time, read),
        posture=whole.command,
        read=~bad & whole.enabled,
    )


def examine_joint(
    joint: str,
    episodes: Mapping[str, FollowedMotion],
    found: Sequence[Finding],
    angles: Sequence[Array],
) -> JointExamination:
    """Examine one joint.

    Args:
        episodes: Its motion in each, by the episode's name.
        found: What the checks of recordings say of it. Where that is no reading of this joint, in
            most episodes, no advice follows from how it seems to move; else from the others.
        angles: Its angle in each episode as it was recorded [rad], shape (T,).
    """
    count = sum(len(motion.time) for motion in episodes.values())
    stamps = [stamp_faults(motion.time) for motion in episodes.values()]
    dropped = sum(missing for missing, _ in stamps)
    late = sum(late for _, late in stamps)
    again = sum(int(repeated_rows(theta).sum()) for theta in angles)
    strange = {finding.recording for finding in found if finding.check not in ROWS_ALONE}
    usable = {name: motion for name, motion in episodes.items() if name not in strange}
    if not strange <= episodes.keys() or 2 * len(strange) >= max(len(episodes), 2):
        usable = {}
    following, apart = follow_most(usable)
    found = [*found, *apart]
    whole = {name: m for name, m in usable.items() if name not in {one.recording for one in apart}}
    motions = [*whole.values()]
    offsets = {} if following is None else {n: offset_of(m, following) for n, m in whole.items()}
    held = 0.0
    if following is None or follows(following):
        held = sum(int((held_rows(m) & m.good).sum()) for m in motions) / count
    faults = [*found, *row_faults(joint, held, dropped, late, count)]
    if following is not None:
        faults += following_faults(following, offsets)
    return JointExamination(
        joint=joint,
        following=following,
        offsets=tuple(offsets.values()),
        held_share=held,
        dropped=dropped,
        late=late + again,
        faults=tuple(faults),
    )


def pauses(whole: Recording) -> Iterator[Finding]:
    """Say where the clock of an episode leaps ahead."""
    steps = np.diff(whole.time) / np.median(np.diff(whole.time))
    for row in np.flatnonzero(steps > PAUSE):
        yield Examined("all", "t").defect(
            f"{whole.name.removesuffix('.csv')}: the clock leaps by "
            f"{whole.time[row + 1] - whole.time[row]:.4g} s before row {row + 1}",
            "it was set, or the recording paused: cut the episode there",
        )


def stamp_faults(time: Array) -> tuple[int, int]:
    """Return how many rows of an episode are missing and how many came late, by their stamps."""
    steps = np.diff(time) / np.median(np.diff(time))
    over, made_up = steps - 1.0, np.r_[np.maximum(0.0, 1.0 - steps[1:]), 0.0]
    missing = np.rint(np.maximum(0.0, over - made_up))
    missing[missing > PAUSE] = 0.0
    return int(np.sum(missing)), int(np.sum((over > LATE) & (missing == 0.0)))
