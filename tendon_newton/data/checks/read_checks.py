"""Angles that were not read: another number in their place, or the last one again."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from tendon_newton.data.checks.command_checks import lead_of
from tendon_newton.data.checks.finding import Examined, Finding
from tendon_newton.data.checks.following import expected
from tendon_newton.data.checks.measures import (
    calm,
    most_around,
    names_of,
    noise_of,
    resolution,
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
FEW_JUMPS = 0.02  # Share of all steps that may be jumps [1]; more are how it moves
ANSWERED = 1.0  # [s] within which a step of a command is answered, rung off included
ASKED = 0.25  # [1] of a jump of the angle, which a step of its command must not reach
EDGE = 0.1  # [1] of the rows, at either end, in which a bus may not be read
OFTEN = 2  # Rows with one wrong number from which it is known as wrong
FEW = 0.01  # Share of the rows that any bus repeats [1]
AGAIN = 3  # Rows in a row that may repeat one reading; more are a rest, or frozen


def failed_reads(recording: Recording) -> Iterator[Finding]:
    """Rows that lie far from where their neighbours lead: a register that was not read."""
    for place, column in enumerate(names_of(recording, "theta")):
        bad = unread_angles(recording, place)
        if bad.any():
            yield not_read(recording, column, bad, value_text(recording, place, bad))


def neighbours_reads(recording: Recording, joints: Sequence[str]) -> Iterator[tuple[int, Finding]]:
    """Rows in which a joint shows another's angle, each with its place: its log alone hides them.

    Args:
        recording: All joints beside each other.
        joints: Their names, in the order of the recording's columns.
    """
    angles = recording.motor_position
    for place in range(len(joints)):
        bad = failed_rows(angles, place) | copied_rows(recording, place)
        if (bad & ~failed_rows(angles[:, [place]], 0)).any():
            value = value_text(recording, place, bad)
            told = re.sub(r"\btheta_(\d+)\b", lambda found: joints[int(found[1])], value)
            found = not_read(recording, "theta", bad, told)
            yield place, replace(found, check="failed read", safe=True)


def not_read(recording: Recording, column: str, bad: Mask, value: str) -> Finding:
    """Say that rows lie beside the motion, and what stands there."""
    return Examined(recording.name, column).defect(
        f"{rows_text(bad, recording.time)} lie beside the motion, {value}",
        "the angle was not read there: leave those rows out",
    )


def unread_angles(recording: Recording, place: int) -> Mask:
    """Tell in which rows another number stands in the place of an angle, shape (T,)."""
    lone = failed_rows(recording.motor_position, place)
    angles = recording.motor_position.copy()
    if lone.any() and not lone.all():
        angles[lone, place] = np.interp(
            recording.time[lone], recording.time[~lone], angles[~lone, place]
        )
    bridged = replace(recording, motor_position=angles)
    return lone | jumped_rows(bridged, place) | copied_rows(recording, place)


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


def jumped_rows(recording: Recording, place: int) -> Mask:
    """Tell in which stretches an angle stands off: it jumps there and back, as its command did not.

    Where no command was logged none explains a jump.

    Args:
        place: The angle to look at.
    """
    theta, bad = recording.motor_position[:, place], np.zeros(recording.sample_count, np.bool_)
    if theta.size < LEAST_ROWS:
        return bad
    off, jumps = unasked_jumps(recording, place)
    if jumps.size and lead_of(recording, place) is not None:
        return bad  # the angle is the command, and the command its answer
    steps = np.diff(off)
    pace = float(np.delete(np.abs(steps), jumps).max()) if jumps.size < steps.size else 0.0
    for out, back in pairwise(jumps):
        lasts = NEAR_ROWS < back - out < (1.0 - LEAST_SHARE) * theta.size  # single rows: lone_rows
        again = abs(off[back + 1] - off[out]) < min((back - out + 1) * pace, 0.5 * abs(steps[out]))
        if lasts and again and not bad[out]:
            bad[out + 1 : back + 1] = steps[out] * steps[back] < 0.0
    if jumps.size:  # a bus that is not read yet, or no more
        stay = np.median(np.diff(np.flatnonzero(np.r_[True, np.diff(theta) != 0.0, True])))
        for rows in (slice(jumps[0] + 1), slice(jumps[-1] + 1, None)):
            part = theta[rows]
            if max(NEAR_ROWS, stay) < part.size < EDGE * theta.size and np.ptp(part) == 0.0:
                bad[rows] = True
    return bad


def unasked_jumps(recording: Recording, place: int) -> tuple[Array, Indices]:
    """Return what an angle is off its command [rad], shape (T,), and before which rows it jumps.

    Steps of the command explain a jump soon after; where no command was logged none does.
    """
    theta = recording.motor_position[:, place]
    off, goals = theta, np.zeros((theta.size, 1))
    if recording.command is not None:
        off, goals = theta - expected(recording, place), recording.command
        goals = goals if recording.coupled else goals[:, [place]]
    leaps, steps = np.abs(np.diff(goals, axis=0)).max(axis=1), np.diff(off)
    window = max(1, round(ANSWERED / float(np.median(np.diff(recording.time)))))
    asked = sliding_window_view(np.pad(leaps, (window, 0)), window + 1).max(axis=1)
    sizes = np.minimum(np.abs(steps), np.abs(np.diff(theta)))
    return off, jumps_of(np.where(asked < ASKED * sizes, steps, 0.0), floor_of(theta))


def copied_rows(recording: Recording, place: int) -> Mask:
    """Tell in which stretches an angle is that of another joint, which follows its own command."""
    angles, bad = recording.motor_position, np.zeros(recording.sample_count, np.bool_)
    if recording.command is None or recording.sample_count < LEAST_ROWS:
        return bad
    for other in set(range(recording.tendon_count)) - {place}:
        found = [
            slice(first, end)
            for first, end in stretches(angles[:, place] == angles[:, other])
            if AGAIN < end - first < LEAST_SHARE * bad.size and np.ptp(angles[first:end, other])
        ]
        if found:
            off = [np.abs(angles[:, k] - expected(recording, k)) for k in (place, other)]
            for rows in found:
                mine, its = float(off[0][rows].mean()), float(off[1][rows].mean())
                bad[rows] |= mine > max(FAR * its, floor_of(angles[:, place]))
    return bad


def jumps_of(steps: Array, floor: float) -> Indices:
    """Return the few steps that are far greater than all others, in their order."""
    sizes = np.abs(steps)
    order = np.argsort(-sizes, kind="stable")[: max(2, round(FEW_JUMPS * steps.size)) + 1]
    falls = np.flatnonzero(sizes[order[:-1]] > FAR * np.maximum(sizes[order[1:]], floor))
    return np.sort(order[: falls[-1] + 1]) if falls.size else order[:0]


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
    return f"the first at {theta[row, place]:.4g} rad between {before:.4g} and {after:.4g} rad"


def repeated_reads(recording: Recording) -> Iterator[Finding]:
    """Rows that hold the angle of the row before although the joint moves on."""
    for place, column in enumerate(names_of(recording, "theta")):
        again = repeated_rows(recording.motor_position[:, place])
        if again.any():
            few = again.mean() < FEW
            yield Examined(recording.name, column).found(
                "note" if few else "caution",
                f"{rows_text(again, recording.time)} repeat the row before amid a motion",
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
    last, rows_before = -1, 1  # a step that catches up is of all rows that it makes up for
    for first, end in stretches(steps == 0.0):
        made_up = rows_before if last == first - 1 else 1
        last, rows_before = end, end - first + 1
        if first == 0 or end == steps.size or end - first > AGAIN:
            continue
        before, after = steps[first - 1] / made_up, steps[end]
        if abs(steps[first - 1]) > floor and after / before > 0.5 * (end - first + 1):
            again[first + 1 : end + 1] = True
    return again


def bridged(values: Array) -> Array:
    """Return a column with a straight line across rows that repeat the one before, shape (T,)."""
    rows = np.arange(values.size)
    fresh = np.r_[True, np.diff(values) != 0.0]
    return np.interp(rows, rows[fresh], values[fresh])
