"""Angles that stand still although nothing holds them: frozen or slow readings, a motor off."""

from collections.abc import Iterator, Sequence

import numpy as np

from tendon_newton.data.checks.finding import Examined, Finding
from tendon_newton.data.checks.following import expected
from tendon_newton.data.checks.measures import names_of, resolution, rest_band, rows_text, stretches
from tendon_newton.data.checks.read_checks import AGAIN, FAR, floor_of
from tendon_newton.data.recording import Array, Indices, Mask, Recording
from tendon_newton.data.stamps import GAP

LEAST_ROWS = 20  # Rows in motion below which nothing is known of a joint
LONGEST_WAIT = 25  # Rows from one reading to the next that are looked for
AT_ONE_PACE = 0.97  # [1] of the changes, which fall on every so manieth row of a slow reading
LINE = 1e-6  # [rad] within which three rows lie on a line
COARSE = 8e-3  # [rad] the coarsest servos have 1024 counts in 300 degrees
LEVELS = 10  # Values of a column from which their distance is its count


def frozen_reads(recording: Recording) -> Iterator[Finding]:
    """Rows in which an angle stands still while its command leaves it as far as nowhere else.

    Without a command, those after which it jumps as it moves nowhere else.
    """
    frozen = frozen_rows(recording)
    for place, column in enumerate(names_of(recording, "theta")):
        rows = frozen[:, place]
        if not rows.any():
            continue
        theta = recording.motor_position[rows, place]
        seen = f"{rows_text(rows, recording.time)} stand still, the first at {theta[0]:.4g} rad, "
        if recording.command is None:
            yield Examined(recording.name, column).defect(
                f"{seen}and then jump", "the reading froze: leave those rows out"
            )
        else:
            moved = float(np.ptp(recording.command[rows, place]))
            yield Examined(recording.name, column).defect(
                *(
                    (
                        f"{seen}while theta_d moves by {moved:.3g} rad",
                        "the reading froze, or the motor was off: leave those rows out, or say in "
                        "enabled that it was off",
                    )
                    if moved > 0.0
                    else (
                        f"{seen}and theta_d with it; then both jump",
                        "the recorder stood still and wrote one row again: leave those rows out",
                    )
                )
            )


def slow_reads(recording: Recording) -> Iterator[Finding]:
    """Angles that are read in every so manieth row alone, or whose digits were cut."""
    for place, column in enumerate(names_of(recording, "theta")):
        theta = recording.motor_position[:, place]
        seen = Examined(recording.name, column)
        for bend, between in ((np.diff(theta), "stays"), (np.diff(theta, 2), "goes straight")):
            if every := pace_of_changes(np.flatnonzero(np.abs(bend) > LINE)):
                yield seen.caution(
                    f"{between} for {every} rows at a time: it is read once in {every} rows",
                    "delays and lags below that time are not told: log a row where it is read, or "
                    "say resample in the mapping",
                )
                break
        count = resolution(theta)
        steps = (
            np.unique(np.round(np.abs(np.diff(theta)) / count)) if count > COARSE else np.empty(0)
        )
        # one step in every row, and maybe a turn, is a steady motion
        if (0.0 in steps or steps.size > 2) and np.unique(theta).size >= LEVELS:
            yield seen.caution(
                f"changes in steps of {1e3 * count:.3g} mrad, coarser than a servo's encoder",
                "nothing smaller than a step is told: log more of its digits",
            )


def pace_of_changes(rows: Indices) -> int:
    """Return on every which row alone a column changes; 0 where it does in any."""
    for every in range(LONGEST_WAIT, 1, -1):
        if rows.size > LEAST_ROWS:
            most = float(np.bincount(rows % every).max())
            if most > AT_ONE_PACE * rows.size:
                return every
    return 0


def frozen_rows(recording: Recording) -> Mask:
    """Tell in which rows each angle stands still although nothing holds it, shape (T, D).

    Joints that begin and end a rest in the same rows as one that froze are frozen like it.
    """
    frozen = np.zeros(recording.motor_position.shape, dtype=np.bool_)
    rests = [rests_of(recording, place) for place in range(recording.tendon_count)]
    finders = (stalled_rests, *(() if recording.command is None else (frozen_rests,)))
    found = {
        rest
        for place, own in enumerate(rests)
        for find in finders
        for rest in find(recording, place, own)
    }
    for place, own in enumerate(rests):
        for first, end in found.intersection(own):
            frozen[first:end, place] = True
    return frozen


Rests = Sequence[tuple[int, int]]
"""First row of each stretch in which an angle stays the same, and the row after its last."""


def rests_of(recording: Recording, place: int) -> Rests:
    """Return where an angle stays longer than a read may fail or take, its motor on.

    Nobody knows what was commanded in a gap: a rest before or after one may be held by anything.
    """
    theta = recording.motor_position[:, place]
    every = pace_of_changes(np.flatnonzero(np.abs(np.diff(theta)) > LINE))
    still = stretches(np.diff(theta) == 0.0)
    pauses = np.diff(recording.time, prepend=recording.time[0], append=recording.time[-1])
    gap = pauses > GAP * np.median(pauses)
    return [
        (int(first), int(end) + 1)
        for first, end in still
        if end - first > max(AGAIN, every)
        and recording.enabled[first : end + 1].all()
        and not gap[first : end + 2].any()
    ]


def stalled_rests(recording: Recording, place: int, rests: Rests) -> Rests:
    """Return rests in which the whole row stayed the same and then jumped.

    No joint answers a goal in the row of that goal, and none jumps farther than it ever moves. Of a
    joint without a goal the angle tells alone: what sticks does not jump when it lets go.
    """
    theta, goals = recording.motor_position, recording.command
    steps = np.abs(np.diff(theta[:, place], append=theta[-1:, place]))
    whole = [
        (first, end)
        for first, end in rests
        if end < len(theta)
        and not np.ptp(theta[first:end], axis=0).any()
        and (goals is None or not np.ptp(goals[first:end], axis=0).any())
        and (goals is None or goals[end, place] != goals[end - 1, place])
    ]
    others = np.delete(steps, [end - 1 for _, end in whole])
    most = max(FAR * float(others.max(initial=0.0)), floor_of(theta[:, place]))
    return [(first, end) for first, end in whole if steps[end - 1] > most]


def frozen_rests(recording: Recording, place: int, rests: Rests) -> Rests:
    """Return the rests of an angle in which nothing holds it.

    An end stop or dry friction holds a shaft too. Neither lets the command pass to both sides
    farther than the shaft is ever off, or to the inside of all it reached, and neither lets the
    angle jump at once when it lets go.
    """
    theta = recording.motor_position[:, place]
    resting = rows_within(rests, theta.size)
    if not rests or np.sum(~resting) < LEAST_ROWS:
        return []
    goal = expected(recording, place, ~resting)
    error = goal - theta
    released = [abs(error[end - 1]) for _, end in rests if end < theta.size]
    stuck = max(float(np.abs(error[~resting]).max()), float(np.median(released or [0.0])))
    band = rest_band(theta)
    far = [
        (first, end)
        for first, end in rests
        if np.abs(error[first:end]).max() > 2.0 * stuck
        and np.ptp(goal[first:end]) > max(stuck, band)
        and not held_at_end(theta, error, first, end, band)
    ]
    steps = np.abs(np.diff(error, append=error[-1:]))
    fastest = float(np.delete(steps, [end - 1 for _, end in far]).max())
    return [
        (first, end)
        for first, end in far
        if min(error[first:end].max(), -error[first:end].min()) > stuck
        or held_at_end(theta, -error, first, end, band)
        or steps[end - 1] > FAR * fastest
    ]


def rows_within(rests: Rests, count: int) -> Mask:
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
