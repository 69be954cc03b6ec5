"""Columns that are no command of their angle: turned, exchanged, its changes, its speed, a copy."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tendon_newton.data.checks.finding import Examined, Finding
from tendon_newton.data.checks.following import LATEST
from tendon_newton.data.checks.measures import names_of, place_of, rest_band, rows_text, stretches
from tendon_newton.data.recording import Array, Mask, Recording

LEAST_TIME = 1.0  # [s] the slowest servo here answers a step in half of it
ALIKE = 0.8  # [1] correlation from which one column is made of another
LIKE, UNLIKE = 0.7, 0.4  # [1] correlation of what follows loosely, and of what does not
CLEARER = 0.25  # [1] of the square that is left, which the better reading leaves
SAME_SIZE = (0.5, 2.0)  # [1] of a column's slope on another that is the same quantity
LEAST_ROWS = 20  # Rows that a correlation needs
ON_ITS_OWN = 0.25  # [1] of its motion, which no load moves a servo on one goal
STRANGE = 0.3  # [1] correlation that no servo was seen to stay below, however it sticks
ALIKE_COMMANDS = 0.01  # [1] of a command's square, which others do not tell where it has its own
MOVED = 0.1  # [rad] a shaft that keeps its command is pushed no farther
SLOWEST = 0.4  # [s] a servo that takes longer for a way is rarer than a speed in another unit
SHIFTS = range(-3, 4)  # Rows by which a copy may be moved
APART, APARTS = 5.0, 200  # [s] by which clocks may be apart, and places that are tried
COPIED = 0.9  # [1] of the rows in motion that are equal in a copy
TAKEN = 0.05  # [1] of the work to and fro: a joint that ends where it began took none
ALWAYS = 0.95  # [1] of an angle's way that goes toward its command, as to a goal far away
AS_ASKED = 0.97  # [1] correlation of a speed with its command; a motor at its limit has less


@dataclass(frozen=True, kw_only=True)
class Likeness:
    """How an angle goes with a command that comes before it."""

    same: float  # Greatest correlation over all delays [1]
    turned: float  # The same with the command turned around [1]
    same_delay: int  # Rows
    turned_delay: int  # Rows
    turned_slope: float  # Angle per command turned around, at its delay [1]


def likeness(
    command: Array, theta: Array, delays: range, used: Mask, others: Array | None = None
) -> Likeness:
    """Correlate an angle with a command at several delays, shape (T,) each.

    Args:
        used: Rows of the angle that count, shape (T,).
        others: Commands that move it too, whose part is taken from both before, shape (T, N).
    """
    scores = np.zeros((len(delays), 2))
    for k, delay in enumerate(delays):
        rows = used[delay:]
        goal, angle = command[: len(command) - delay][rows], theta[delay:][rows]
        goal, angle = goal - goal.mean(), angle - angle.mean()
        whole = goal @ goal
        if others is not None:
            moved = others[: len(command) - delay][rows]
            basis, _ = np.linalg.qr(moved - moved.mean(axis=0))
            goal, angle = (x - basis @ (basis.T @ x) for x in (goal, angle))
        size = float(np.sqrt((goal @ goal) * (angle @ angle)))
        if size > 0.0 and goal @ goal > ALIKE_COMMANDS * whole:
            scores[k] = goal @ angle / size, goal @ angle / (goal @ goal)
    most, least = int(np.argmax(scores[:, 0])), int(np.argmin(scores[:, 0]))
    return Likeness(
        same=float(scores[most, 0]),
        turned=-float(scores[least, 0]),
        same_delay=delays[most],
        turned_delay=delays[least],
        turned_slope=-float(scores[least, 1]),
    )


def follows(recording: Recording) -> float:
    """Return how well the angle that follows its command best does so [1], motors on or off."""
    goals, every = recording.command, np.ones(recording.sample_count, dtype=np.bool_)
    if goals is None or recording.sample_count < LEAST_ROWS:
        return 0.0
    delays, pairs = delays_of(recording), zip(goals.T, recording.motor_position.T, strict=True)
    return max(likeness(goal, theta, delays, every).same for goal, theta in pairs)


def clock_text(recording: Recording, place: int, same: float) -> tuple[str, str] | None:
    """Say how far apart the clocks of an angle and its command are, where far ones fit better."""
    assert recording.command is not None
    step, every = float(np.median(np.diff(recording.time))), np.ones(recording.sample_count) > 0.0
    farthest = min(round(APART / step), recording.sample_count // 3)
    goal, theta = recording.command[:, place], recording.motor_position[:, place]
    nearest = delays_of(recording)[-1] + 1
    far = range(nearest, farthest, max(1, farthest // APARTS))
    if not far:
        return None
    late, early = (likeness(a, b, far, every) for a, b in ((goal, theta), (theta, goal)))
    best, word = (late, "after") if late.same > early.same else (early, "before")
    if best.same < ALIKE or 1.0 - best.same**2 > CLEARER * (1.0 - max(same, 0.0) ** 2):
        return None
    if likeness(goal, goal, far, every).same > ALIKE:
        return None  # a command that comes again is followed at any of its turns
    return (
        f"{best.same_delay * step:.2g} s {word} theta_d: it follows it there (correlation "
        f"{best.same:.2f}; {same:.2f} within {LATEST:g} s)",
        "angle and command were stamped by two clocks: put both on one clock",
    )


def lead_of(recording: Recording, place: int) -> Likeness | None:
    """Return how a command follows its angle, later than a bus is read; None where it leads it."""
    if recording.command is None or recording.coupled or recording.sample_count < LEAST_ROWS:
        return None
    goal, theta = recording.command[:, place], recording.motor_position[:, place]
    delays, every = delays_of(recording), np.ones(recording.sample_count, dtype=np.bool_)
    late, early = (likeness(a, b, delays, every) for a, b in ((goal, theta), (theta, goal)))
    left, other = 1.0 - early.same**2, 1.0 - max(late.same, 0.0) ** 2
    sure = early.same > ALIKE and early.same_delay > 1 and left < CLEARER * other
    return early if sure and moves(goal) and moves(theta) else None


def moves(values: Array) -> bool:
    """Tell whether a column goes farther than one that rests."""
    return bool(np.ptp(values) > rest_band(values))


def delays_of(recording: Recording) -> range:
    """Return the delays of a servo in rows."""
    step = float(np.median(np.diff(recording.time)))
    return range(min(max(2, round(LATEST / step)), recording.sample_count // 4) + 1)


def answering(recording: Recording, place: int) -> Mask:
    """Tell in which rows an angle may answer: the motor is on, and nothing holds it for long."""
    assert recording.command is not None
    time, goal = recording.time, recording.command[:, place]
    used = recording.enabled.copy()
    for first, end in stretches(np.diff(recording.motor_position[:, place]) == 0.0):
        if time[end] - time[first] > LATEST and np.ptp(goal[first : end + 1]) > 0.0:
            used[first : end + 1] = False
    return used


def no_command(recording: Recording) -> Iterator[Finding]:
    """A command that is another quantity than the goal of its angle."""
    if recording.command is None or recording.sample_count < LEAST_ROWS:
        return
    delays = delays_of(recording)
    for place, column in enumerate(names_of(recording, "theta_d")):
        goal, theta = recording.command[:, place], recording.motor_position[:, place]
        if not moves(goal) or not moves(theta):
            continue
        used = answering(recording, place)
        if used.sum() < LEAST_ROWS:
            continue
        like = likeness(goal, theta, delays, used, others_of(recording, place))
        seen = Examined(recording.name, column)
        if reversed_joint(like):
            yield seen.defect(
                f"theta goes the other way (correlation {-like.turned:.2f})",
                "angle and command count in opposite directions: turn the sign of one (sign = -1 "
                "in the mapping; calibrate the joint anew)",
            )
        elif recording.coupled:
            continue  # what else is said below is of a servo that moves alone
        elif (size := likeness(np.abs(goal), theta, delays, used).same) > ALIKE and (
            theta.min() >= 0.0 > goal.min() and 1.0 - size**2 < CLEARER * (1.0 - like.same**2)
        ):
            yield seen.defect(
                f"goes below zero, and theta with its size (correlation {size:.2f}; "
                f"{like.same:.2f} with theta_d)",
                "theta is a size, and its sign was lost: map the column that has it",
            )
        elif (alone := unasked_rows(recording, place)).any():
            yield seen.defect(
                f"{rows_text(alone, recording.time)} hold one goal while theta goes "
                f"{np.ptp(theta[alone]):.3g} rad to and fro",
                "the goal was not logged there, the motor was off, or somebody moved the joint: "
                "leave those rows out, or say enabled",
            )
        elif seeks(recording, place, delays):
            continue
        elif (found := rate_text(recording, place, like.same, delays)) is not None:
            yield seen.defect(*found)
        elif (apart := clock_text(recording, place, like.same)) is not None:
            yield Examined(recording.name, names_of(recording, "theta")[place]).defect(*apart)
        elif like.same < STRANGE and np.ptp(theta) > MOVED and used.mean() > 0.5:
            yield seen.defect(
                f"has nothing to do with theta (correlation {like.same:.2f} at best)",
                "theta_d must be the goal of this angle in its unit: it may be another joint's, a "
                "place of the tip, or the motor was off",
            )


def others_of(recording: Recording, place: int) -> Array | None:
    """Return the commands of other servos that turn a motor too, shape (T, N); None without any."""
    if recording.command is None or not recording.coupled:
        return None
    return np.delete(recording.command, place, axis=1)


def unasked_rows(recording: Recording, place: int) -> Mask:
    """Tell in which rows an angle goes on to and fro for long although its goal stays, shape (T,).

    What rings, creeps or seeks its goal slowly goes less far the longer it does.
    """
    assert recording.command is not None
    time, theta = recording.time, recording.motor_position[:, place]
    alone = np.zeros(theta.size, dtype=np.bool_)
    for first, end in stretches(np.diff(recording.command[:, place]) == 0.0):
        begin = int(np.searchsorted(time, time[first] + LEAST_TIME))
        middle = (begin + end) // 2
        if time[end] - time[first] < 3.0 * LEAST_TIME or not recording.enabled[first:end].all():
            continue
        halves = theta[begin:middle], theta[middle : end + 1]
        least = max(MOVED, ON_ITS_OWN * float(np.ptp(theta)))
        paths = [float(np.abs(np.diff(half)).sum()) for half in halves]
        to_and_fro = all(
            np.ptp(half) > least and path > 1.5 * abs(half[-1] - half[0])
            for half, path in zip(halves, paths, strict=True)
        )
        alone[first : end + 1] |= bool(to_and_fro and np.ptp(halves[1]) > 0.5 * np.ptp(halves[0]))
    return alone


def reversed_joint(like: Likeness) -> bool:
    """Tell whether an angle follows its command turned around.

    A sine turned around is the same sine half a period later: then the sooner one is it.
    """
    if like.turned < LIKE or like.turned <= like.same:
        return False
    left, other = 1.0 - like.turned**2, 1.0 - max(0.0, like.same) ** 2
    sooner = like.turned_delay < like.same_delay
    return (
        like.same < UNLIKE
        or left < CLEARER * other
        or (sooner and SAME_SIZE[0] < like.turned_slope < SAME_SIZE[1])
    )


def seeks(recording: Recording, place: int, delays: range) -> bool:
    """Tell whether an angle goes the way to its command, however slowly: that is its goal.

    A motor that turns for seconds resembles its command little, and its speed resembles it much,
    though less than a speed that was asked for does.
    """
    goal, theta, speed = smoothed(recording, place, delays)
    if 0.0 in (np.ptp(goal), np.ptp(goal - theta), np.ptp(speed)):
        return False
    along, toward = (float(np.corrcoef(x, speed)[0, 1]) for x in (goal, goal - theta))
    way = float(np.sign(goal - theta) @ speed / np.abs(speed).sum())
    asked = likeness(goal, speed, delays, np.ones(len(goal), dtype=np.bool_)).same
    return toward > max(UNLIKE, along) or (way > ALWAYS and asked < AS_ASKED)


def smoothed(recording: Recording, place: int, delays: range) -> tuple[Array, Array, Array]:
    """Return command, angle and speed of a servo without what is faster than it answers."""
    assert recording.command is not None
    theta = recording.motor_position[:, place]
    window = max(1, delays[-1] // 2)
    kernel = np.full(window, 1.0 / window)
    columns = recording.command[:, place], theta, np.gradient(theta, recording.time)
    goal, angle, speed = (np.convolve(column, kernel, mode="valid") for column in columns)
    return goal, angle, speed


def rate_text(
    recording: Recording, place: int, same: float, delays: range
) -> tuple[str, str] | None:
    """Say how a command goes with the speed of its angle, where it does so far better."""
    assert recording.command is not None
    step = float(np.median(np.diff(recording.time)))
    goal, _, speed = smoothed(recording, place, delays)
    like = likeness(goal, speed, delays, np.ones(len(goal), dtype=np.bool_))
    if like.same < ALIKE or 1.0 - like.same**2 > CLEARER * (1.0 - same**2):
        return None
    shifted = goal[: len(goal) - like.same_delay], speed[like.same_delay :]
    # a speed that is asked for has the zero of its command, a weak motor amid a sine has not
    proportion = float(shifted[0] @ shifted[1] / np.sqrt(np.prod([x @ x for x in shifted])))
    if proportion < ALIKE:
        return None
    slope = float(np.cov(*shifted)[0, 1] / np.var(shifted[0]))  # [1/s] or [1]
    evidence = f"goes with the speed of theta (correlation {like.same:.2f}), not with theta"
    if slope > 1.0 / SLOWEST and slope * step < SAME_SIZE[0]:
        return evidence + f", by one in {1e3 / slope:.0f} ms", (
            "it holds the way from the angle of its row to the goal: add that angle"
        )
    if SAME_SIZE[0] < slope * step < SAME_SIZE[1]:
        return evidence, (
            "it holds the change of each row, not a goal: add the changes up, or add each to the "
            "angle of its row"
        )
    return evidence + f", {slope:.3g} rad/s a unit", (
        "it is a speed command, and theta_d is the goal of an angle: add it up over time"
    )


def copied(recording: Recording) -> Iterator[Finding]:
    """A command that is the measured angle itself, maybe some rows off."""
    if recording.command is None or recording.sample_count < LEAST_ROWS:
        return
    for place, column in enumerate(names_of(recording, "theta_d")):
        goal, theta = recording.command[:, place], recording.motor_position[:, place]
        for shift in sorted(SHIFTS, key=abs):
            own = goal[max(0, -shift) : len(goal) - max(0, shift)]
            other = theta[max(0, shift) : len(theta) - max(0, -shift)]
            moving = np.abs(np.gradient(other)) > 0.0
            if moving.sum() > 10 and np.mean((own == other)[moving]) > COPIED:
                rows = f"theta of {abs(shift)} rows {'later' if shift > 0 else 'before'}"
                yield Examined(recording.name, column).defect(
                    f"equals {'theta' if shift == 0 else rows} in "
                    f"{100.0 * np.mean(own == other):.0f} % of the rows",
                    "one column stands for both, and no command was logged: map the goal that was "
                    "sent as theta_d",
                )
                break


def turned_force(recording: Recording) -> Iterator[Finding]:
    """A force or torque that takes work from what it moves, where no command was recorded.

    Friction only takes work, so that what moves a joint to and fro gives some.
    """
    if recording.command is not None or recording.force is None:
        return
    for place, column in enumerate(names_of(recording, "force")):
        force, theta = recording.force[:, place], recording.motor_position[:, place]
        work = 0.5 * (force[1:] + force[:-1]) * np.diff(theta)
        taken, given = -float(work[work < 0.0].sum()), float(work[work > 0.0].sum())
        if taken - given > TAKEN * (taken + given) and np.ptp(theta) > MOVED:
            times = f"{taken / given:.2g} times what it gives" if given else "and gives none"
            yield Examined(recording.name, column).defect(
                f"takes work from what it moves, {times}",
                "force and theta count in opposite directions, or are exchanged: turn the sign of "
                "one (sign = -1 in the mapping)",
            )


def idle(recording: Recording) -> Iterator[Finding]:
    """Commands and angles that never change."""
    goals, angles = recording.command, recording.motor_position
    if goals is None or recording.duration < LEAST_TIME:
        return
    asked = [bool(np.ptp(goal) > 0.0) for goal in goals.T]
    if not any(asked) and not any(np.ptp(theta) > 2.0 * rest_band(theta) for theta in angles.T):
        yield Examined(recording.name, "theta").defect(
            f"moves by {1e3 * float(np.ptp(angles, axis=0).max()):.2g} mrad in "
            f"{recording.sample_count} rows, and theta_d by nothing",
            "nothing moves, so nothing can be told: record 10 s or more with the command in motion",
        )
        return
    names, columns = names_of(recording, "theta_d"), names_of(recording, "theta")
    for place, (goal, theta) in enumerate(zip(goals.T, angles.T, strict=True)):
        if not asked[place] and np.ptp(theta) > MOVED:
            yield Examined(recording.name, names[place]).defect(
                f"is {goal[0]:.4g} rad in all rows while theta moves by {np.ptp(theta):.3g} rad",
                "it is no command of this motion: map the column of the goal that was sent",
            )
        if np.ptp(theta) == 0.0 and asked[place] and recording.enabled.all():
            yield Examined(recording.name, columns[place]).defect(
                f"is {theta[0]:.4g} rad in all rows while theta_d moves by {np.ptp(goal):.3g} rad",
                "the motor was off, or this is no reading of it: say enabled, or map another "
                "column",
            )


def exchanged_joints(recording: Recording) -> Iterator[Finding]:
    """Joints whose angles follow each other's commands."""
    goals = recording.command
    if goals is None or recording.tendon_count < 2 or recording.sample_count < LEAST_ROWS:
        return
    delays = delays_of(recording)
    columns = names_of(recording, "theta")
    used = recording.enabled
    if used.sum() < LEAST_ROWS:
        return
    score = np.array(
        [
            [
                likeness(goal, theta, delays, used, others_of(recording, k)).same
                if moves(goal)
                else 0.0
                for k, goal in enumerate(goals.T)
            ]
            for theta in recording.motor_position.T
        ]
    )
    for place in np.flatnonzero([moves(theta) for theta in recording.motor_position.T]):
        best = int(np.argmax(score[place]))
        own, other = float(score[place, place]), float(score[place, best])
        if recording.coupled and not (np.argmax(score[best]) != best and max(score[best]) > LIKE):
            continue  # a string that the other one pulls follows its command too
        same, its = (recording.motor_position[:, k] for k in (place, best))
        if best != place and np.mean((same == its)[np.gradient(same) != 0.0]) > COPIED:
            yield Examined(recording.name, columns[place]).defect(
                f"equals {columns[best]}, and follows its theta_d",
                "one sensor stands for both: map this joint's own",
            )
        elif best != place and other > ALIKE and 1.0 - other**2 < CLEARER * (1.0 - own**2):
            yield Examined(recording.name, columns[place]).defect(
                f"follows theta_d of {columns[best]} (correlation {other:.2f}; its own {own:.2f})",
                "the columns of the joints are exchanged: put them in one order for angles and "
                "commands",
            )


def exchanges(recording: Recording, joints: Sequence[str]) -> Iterator[tuple[int, Finding]]:
    """Joints that follow each other's commands, told by name, each with its place.

    Args:
        joints: Their names, in the order of the recording's columns.
    """
    for finding in exchanged_joints(recording):
        told = re.sub(r"\btheta_(\d+)\b", lambda found: joints[int(found[1])], finding.evidence)
        named = replace(finding, channel="theta", evidence=told, check="exchanged joints")
        yield place_of(finding.channel), named
