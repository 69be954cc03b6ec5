"""Angles that were not read: another number in their place, the last one again, or frozen."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from tendon_newton.data.checks.finding import Examined, Finding
from tendon_newton.data.checks.measures import (
    calm,
    most_around,
    names_of,
    noise_of,
    resolution,
    rest_band,
    rows_text,
    stretches,
)
from tendon_newton.data.recording import Array, Indices, Mask, Recording

FAR = 2.0  # [1] times the pace around it: no shaft goes so far there and back within two rows
PACE_ROWS = 12  # Rows on either side whose pace counts for a row of any number
NEAR_ROWS = 2  # Rows whose pace counts for a row of a number that is known as wrong
COUNTS = 8.0  # [1] an encoder jitters by less, and what jitter makes of a reading matters little
NOISES = 8.0  # [1] noise of a smooth motion stays within
LEAST_ROWS = 5  # Fewer have no neighbours
COARSE = np.deg2rad(2.0)  # [rad] a joint at rest shows no count; the play of a hobby servo
LEAST_SHARE = 0.5  # [1] of the rows must be others: fewer show no motion to judge a number by
NUMBERS = 8  # Most frequent numbers that are looked at; a bus has one or two for a failed read
STAYS = 2.0  # Rows in a row in which one wrong number stands, in the mean; a rest stays longer
OFTEN = 2  # Rows with one wrong number from which it is known as wrong
FEW = 0.01  # Share of the rows that any bus repeats [1]
AGAIN = 3  # Rows in a row that may repeat one reading; more are a rest, or frozen


def failed_reads(recording: Recording) -> Iterator[Finding]:
    """Rows that lie far from where their neighbours lead: a register that was not read."""
    for place, column in enumerate(names_of(recording, "theta")):
        bad = failed_rows(recording.motor_position, place)
        if bad.any():
            yield not_read(Examined(recording.name, column), bad, value_text(recording, place, bad))


def neighbours_reads(recording: Recording, joints: Sequence[str]) -> Iterator[tuple[int, Finding]]:
    """Rows in which a joint shows another's angle, each with its place: its log alone hides them.

    Args:
        recording: All joints beside each other.
        joints: Their names, in the order of the recording's columns.
    """
    angles = recording.motor_position
    for place in range(len(joints)):
        bad = failed_rows(angles, place)
        if (bad & ~failed_rows(angles[:, [place]], 0)).any():
            value = value_text(recording, place, bad)
            told = re.sub(r"\btheta_(\d+)\b", lambda found: joints[int(found[1])], value)
            found = not_read(Examined(recording.name, "theta"), bad, told)
            yield place, replace(found, check="failed read", safe=True)


def not_read(examined: Examined, bad: Mask, value: str) -> Finding:
    """Say that rows lie beside the motion, and what stands there."""
    return examined.defect(
        f"{rows_text(bad)} lie beside the motion, {value}",
        "the angle was not read there: leave those rows out",
    )


def failed_rows(angles: Array, place: int) -> Mask:
    """Tell in which rows an angle lies far from the motion around it.

    A number that spoiled some rows is looked for in all rows, nearer to the motion too: a constant,
    or what another joint shows in the same row.

    Args:
        angles: Shaft angles [rad], shape (T, D).
        place: The one to look at.
    """
    theta = angles[:, place]
    first = single_rows(theta)
    if first.size < LEAST_ROWS:
        return np.zeros(theta.size, dtype=np.bool_)
    values, lasting = theta[first], np.diff(np.r_[first, theta.size])
    bad = lone_rows(values)
    for wrong in (*np.delete(angles[first], place, axis=1).T, *spikes_of(values)):
        same = wrong == values
        stays = lasting[same].sum() / max(len(stretches(same)), 1)
        if stays <= STAYS and lasting[~same & ~bad].sum() >= LEAST_SHARE * theta.size:
            bad |= spoiled_rows(values, same, bad)
    return np.repeat(bad, lasting)


def lone_rows(values: Array) -> Mask:
    """Tell which rows lie beside their neighbours by some paces of the motion, shape (T,)."""
    usual = calm(values)
    pace = np.maximum(most_around(pace_of(usual), PACE_ROWS), often_around(pace_of(values)))
    steps = np.abs(np.diff(values))
    alone = np.minimum(
        np.abs(values - usual), np.minimum(np.r_[steps[0], steps], np.r_[steps, steps[-1]])
    )
    return alone > np.maximum(FAR * pace, floor_of(values))


def spoiled_rows(values: Array, same: Mask, bad: Mask) -> Mask:
    """Tell which rows of one number are no readings, if it stands far off the others' motion.

    Args:
        values: Angles [rad], shape (T,).
        same: Rows in which the number stands.
        bad: Rows that are known as wrong.
    """
    kept = np.flatnonzero(~same & ~bad)
    if kept.size < LEAST_ROWS:
        return np.zeros_like(same)
    motion = values[kept]
    bend = np.abs(np.r_[0.0, motion[1:-1] - 0.5 * (motion[2:] + motion[:-2]), 0.0])
    rows, floor = np.arange(values.size), floor_of(motion)
    off = same * np.abs(values - np.interp(rows, kept, motion))
    far, near = (
        np.maximum(FAR * np.interp(rows, kept, most_around(bend, reach)), floor)
        for reach in (PACE_ROWS, NEAR_ROWS)
    )
    return off > near if np.sum(off > far) >= OFTEN else np.zeros_like(same)


def floor_of(values: Array) -> float:
    """Return how far a sound reading may lie beside a motion by its encoder alone [rad]."""
    count = resolution(values)
    return max(COUNTS * count, NOISES * noise_of(values)) if count > 0.0 else COARSE


def spikes_of(values: Array) -> Array:
    """Return the numbers at which a column turns back several times, the most frequent ones."""
    steps = np.diff(values)
    numbers, counts = np.unique(values[1:-1][steps[:-1] * steps[1:] < 0.0], return_counts=True)
    most = np.argsort(-counts, kind="stable")[:NUMBERS]
    return numbers[most][counts[most] >= OFTEN]


def single_rows(values: Array) -> Indices:
    """Return the rows of a column without short repeats, which one wrong reading may fill."""
    same = np.r_[False, np.diff(values) == 0.0]
    for first, end in stretches(same):
        same[first:end] = end - first < AGAIN
    return np.flatnonzero(~same)


def pace_of(values: Array) -> Array:
    """Return how far a column goes within two rows, shape (T,)."""
    return np.abs(np.r_[0.0, values[2:] - values[:-2], 0.0])


def often_around(values: Array) -> Array:
    """Return what four in five rows around each one stay below, shape (T,)."""
    padded = np.pad(values, PACE_ROWS, mode="edge")
    return np.quantile(sliding_window_view(padded, 2 * PACE_ROWS + 1), 0.8, axis=1)


def value_text(recording: Recording, place: int, bad: Mask) -> str:
    """Say what stands in rows that were not read."""
    theta = recording.motor_position
    values = theta[bad, place]
    row = int(np.flatnonzero(bad)[0])
    if np.ptp(values) == 0.0 and values.size > 1:
        return f"at {values[0]:.4g} rad each"
    for other, name in enumerate(names_of(recording, "theta")):
        if other != place and np.mean(theta[bad, other] == values) > 0.5:
            return f"where {name} is"
    before, after = theta[max(0, row - 1), place], theta[min(row + 1, theta.shape[0] - 1), place]
    return f"row {row} at {theta[row, place]:.4g} rad between {before:.4g} and {after:.4g} rad"


def repeated_reads(recording: Recording) -> Iterator[Finding]:
    """Rows that hold the angle of the row before although the joint moves on."""
    for place, column in enumerate(names_of(recording, "theta")):
        again = repeated_rows(recording.motor_position[:, place])
        if again.any():
            few = again.mean() < FEW
            yield Examined(recording.name, column).found(
                "note" if few else "caution",
                f"{rows_text(again)} repeat the row before amid a motion",
                "the angle was not read anew there: leave those rows out",
            )


def repeated_rows(theta: Array) -> Mask:
    """Tell which rows repeat an angle amid a motion that then catches up.

    Args:
        theta: Shaft angle [rad], shape (T,).
    """
    steps = np.diff(theta)
    floor = max(0.5 * COUNTS * resolution(theta), NOISES * noise_of(bridged(theta)))
    again = np.zeros(theta.size, dtype=np.bool_)
    for first, end in stretches(steps == 0.0):
        if first == 0 or end == steps.size or end - first > AGAIN:
            continue
        before, after = steps[first - 1], steps[end]
        if abs(before) > floor and after / before > 0.5 * (end - first + 1):
            again[first + 1 : end + 1] = True
    return again


def bridged(values: Array) -> Array:
    """Return a column with a straight line across rows that repeat the one before, shape (T,)."""
    rows = np.arange(values.size)
    fresh = np.r_[True, np.diff(values) != 0.0]
    return np.interp(rows, rows[fresh], values[fresh])


def frozen_reads(recording: Recording) -> Iterator[Finding]:
    """Rows in which an angle stands still while its command leaves it as far as nowhere else."""
    if recording.command is None:
        return
    for place, column in enumerate(names_of(recording, "theta")):
        frozen = frozen_rows(recording, place)
        if frozen.any():
            theta, goal = recording.motor_position[frozen, place], recording.command[frozen, place]
            yield Examined(recording.name, column).defect(
                f"{rows_text(frozen)} stand still, the first at {theta[0]:.4g} rad, while theta_d "
                f"moves by {np.ptp(goal):.3g} rad",
                "the reading froze, or the motor was off: leave those rows out, or say in enabled "
                "that it was off",
            )


def frozen_rows(recording: Recording, place: int) -> Mask:
    """Tell in which rows an angle stands still although nothing holds it.

    An end stop or dry friction holds a shaft too. Neither lets the command pass to both sides
    farther than the shaft is ever off, or to the inside of all it reached, and neither lets the
    angle jump at once when it lets go.
    """
    theta = recording.motor_position[:, place]
    assert recording.command is not None
    goal = recording.command[:, place]
    frozen = np.zeros(theta.size, dtype=np.bool_)
    rests = [
        (first, end + 1)
        for first, end in stretches(np.diff(theta) == 0.0)
        if end - first > AGAIN and recording.enabled[first : end + 1].all()
    ]
    resting = rows_within(rests, theta.size)
    if not rests or resting.all():
        return frozen
    error = goal - theta - np.median((goal - theta)[~resting])
    released = [abs(error[end - 1]) for _, end in rests if end < theta.size]
    usual = float(np.abs(error[~resting]).max())
    stuck = max(usual, float(np.median(released or [0.0])))
    band = rest_band(theta)
    far = [
        (first, end)
        for first, end in rests
        if np.abs(error[first:end]).max() > 2.0 * stuck
        and np.ptp(goal[first:end]) > max(stuck, band)
        and not held_at_end(theta, error, first, end, band)
    ]
    steps = np.abs(np.diff(theta, append=theta[-1:]))
    releases = [end - 1 for _, end in far]
    fastest = float(np.delete(steps, releases).max())
    for first, end in far:
        both = min(error[first:end].max(), -error[first:end].min()) > stuck
        inward = held_at_end(theta, -error, first, end, band)
        if both or inward or steps[end - 1] > FAR * fastest:
            frozen[first:end] = True
    return frozen


def rows_within(rests: Sequence[tuple[int, int]], count: int) -> Mask:
    """Tell which rows lie within stretches."""
    inside = np.zeros(count, dtype=np.bool_)
    for first, end in rests:
        inside[first:end] = True
    return inside


def held_at_end(theta: Array, error: Array, first: int, end: int, band: float) -> bool:
    """Tell whether a rest lies at an end of all that an angle ever reached, its command beyond."""
    low, high = theta.min() + band, theta.max() - band
    beyond = error[first:end]
    return bool(
        (theta[first] >= high and np.median(beyond) > 0.0)
        or (theta[first] <= low and np.median(beyond) < 0.0)
    )
