"""What fails a joint of an arm: how it follows, its rows, its siblings."""

from collections.abc import Iterator, Mapping, Sequence
from math import pi

import numpy as np

from tendon_newton.data.checks.finding import Examined, Finding
from tendon_newton.data.checks.following import FollowedMotion, Following, follow

DEGREE = pi / 180.0
GRIPPER = "gripper"  # In the name of a joint that may hold what it grasps
ANGLE_LIMIT = 5.0 * DEGREE
"""Offset or play from which on a joint fails; a sound SO-101 sags by up to 2.3 degrees and has up
to 4.7 degrees of play (docs/lab/so101.md)."""
LATENESS_LIMIT = 0.2
"""Delay and lag together from which on a joint fails [s]; those of a sound SO-101 are 90 to 120 ms
(docs/lab/so101.md)."""
ABSURD_LAG = 3.0  # [s] what seems to lag by more is no answer to its command
SHARE_LIMIT = 0.01  # Share of the rows that may be held, late or missing [1]
STRANGE = 0.5  # Share of its motion that a joint may be off what was commanded [1]
LEAST_SIBLINGS = 3  # Joints beside which another one stands out
SPREAD = 3.0
"""How many times three quarters of its siblings a joint exceeds that stands out [1]; the weakest
of a sound SO-101 has 2.0 times their play, and 1.6 times their delay and lag."""
LEAST_PLAY = 1.0 * DEGREE  # What a joint must have more than its siblings, at least
LEAST_LATENESS = 0.03  # [s] likewise; a row of LeRobot, to which its stamps hold
MOTION_LIMIT = 2.0 * DEGREE  # Motion of a command below which nothing can be told of its joint
MOTION_ROWS = 4000
"""Rows of a joint that are fitted, from the episodes in which it moves most; two minutes."""
LEAST_EPISODES = 3  # Episodes of which most may follow where one does not


def follow_most(episodes: Mapping[str, FollowedMotion]) -> tuple[Following | None, list[Finding]]:
    """Tell how a joint follows; where a few of its episodes alone do not, say so without them."""
    fitted = moving(list(episodes.values()))
    following = follow(fitted) if fitted else None
    if following is None or follows(following) or len(fitted) < LEAST_EPISODES:
        return following, []
    alone = {name: follow([motion]) for name, motion in episodes.items() if moving([motion])}
    wrong = {name: found for name, found in alone.items() if not follows(found)}
    if not 0 < 2 * len(wrong) < len(alone):
        return following, []
    rest = [motion for name, motion in episodes.items() if name not in wrong]
    return follow(moving(rest)), [
        Examined(name, "theta").defect(
            f"does not follow its command, by {found.residual / DEGREE:.1f} deg RMS",
            "the other episodes do: leave this one out, or record it anew",
        )
        for name, found in wrong.items()
    ]


def moving(motions: Sequence[FollowedMotion]) -> list[FollowedMotion]:
    """Return the episodes in which a joint moves most, up to so many rows."""
    usable = [motion for motion in motions if np.ptp(motion.command) > MOTION_LIMIT]
    chosen: list[FollowedMotion] = []
    for motion in sorted(usable, key=lambda motion: -float(np.ptp(motion.command))):
        if sum(len(other.time) for other in chosen) < MOTION_ROWS:
            chosen.append(motion.until(MOTION_ROWS))
    return chosen


def following_faults(following: Following, offsets: Mapping[str, float]) -> Iterator[Finding]:
    """Say what fails a joint in how it follows; each episode has its offset [rad] by its name."""
    seen = Examined("all", "theta")
    if not follows(following):
        yield seen.defect(
            f"does not follow its command, by {following.residual / DEGREE:.1f} deg RMS",
            "action must hold the goal of the same joint in the same unit",
        )
        return
    offset = float(np.median([*offsets.values()]))
    if abs(offset) > ANGLE_LIMIT:
        yield seen.defect(
            f"reads {offset / DEGREE:+.1f} deg beside its command",
            "calibrate leader and follower anew, or subtract it from observation.state",
        )
    worst = max(offsets, key=lambda name: abs(offsets[name] - offset))
    if abs(offsets[worst] - offset) > ANGLE_LIMIT:
        yield seen.defect(
            f"reads {offsets[worst] / DEGREE:+.1f} deg beside its command in {worst}, "
            f"{offset / DEGREE:+.1f} deg in most",
            "it was calibrated in between, a horn slips, or its load changes",
        )
    lateness = following.delay + following.lag
    if lateness > LATENESS_LIMIT:
        yield seen.defect(
            f"follows {1e3 * lateness:.0f} ms late",
            "look at the loop's rate, the bus and the servo's gain and acceleration registers",
        )
    if following.play > ANGLE_LIMIT:
        yield seen.defect(
            f"has {following.play / DEGREE:.1f} deg of play",
            "tighten horn and screws, or replace a worn gear",
        )


def follows(following: Following) -> bool:
    """Tell whether a joint follows its command at all."""
    return following.residual <= STRANGE * following.motion and following.lag < ABSURD_LAG


def row_faults(joint: str, held: float, dropped: int, late: int, count: int) -> Iterator[Finding]:
    """Say what fails a joint in its rows; a gripper may hold what it grasps."""
    if held > SHARE_LIMIT and GRIPPER not in joint:
        yield Examined("all", "theta").defect(
            f"is held short of its command in {100.0 * held:.0f} % of the time",
            "overload, or something solid: lighten the load or leave those episodes out",
        )
    for rows, word in ((dropped, "missing"), (late, "late")):
        if rows > SHARE_LIMIT * count:
            yield Examined("all", "t").defect(
                f"{rows} of {count} rows are {word}", "the recording computer was too slow"
            )


def beside_siblings(followed: Mapping[str, Following]) -> Iterator[tuple[str, Finding]]:
    """Say which joints stand out by their play or delay, each with its finding; no gripper does."""
    arm = {name: found for name, found in followed.items() if GRIPPER not in name}
    plays = {name: found.play for name, found in arm.items()}
    lateness = {name: found.delay + found.lag for name, found in arm.items()}
    whole = Examined("all", "theta")
    for name, usual in outstanding(plays, LEAST_PLAY, ANGLE_LIMIT):
        seen = f"has {plays[name] / DEGREE:.1f} deg of play, siblings {usual / DEGREE:.1f} deg"
        yield name, whole.defect(seen, "tighten horn and screws, or replace a worn gear")
    for name, usual in outstanding(lateness, LEAST_LATENESS, LATENESS_LIMIT):
        seen = f"follows {1e3 * lateness[name]:.0f} ms late, its siblings {1e3 * usual:.0f} ms"
        mend = "look at the servo's gain and acceleration registers, and at its place on the bus"
        yield name, whole.defect(seen, mend)


def outstanding(
    values: Mapping[str, float], least: float, limit: float
) -> Iterator[tuple[str, float]]:
    """Give the joints whose number is far above what three in four of its siblings stay below.

    Args:
        least: What it must exceed that by.
        limit: What fails a joint alone, which is said elsewhere.
    """
    for name, value in values.items():
        others = [other for sibling, other in values.items() if sibling != name]
        if len(others) >= LEAST_SIBLINGS:
            usual = float(np.quantile(others, 0.75))
            if max(SPREAD * usual, usual + least) < value <= limit:
                yield name, usual
