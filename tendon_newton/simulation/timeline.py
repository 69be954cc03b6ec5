"""The rows that a simulation visits: those of a recording, and those that its log lost.

A bench goes on hearing commands while its log has a gap. Where the command moved smoothly before
and after, the lost commands are interpolated; where it jumped, the last one is held, and the rows
that follow cannot be trusted.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tendon_newton.errors import InvalidRecording
from tendon_newton.recording import Array, Indices, Mask, Recording

GAP_RATIO = 1.5
"""An interval this many times longer than the median has lost rows."""
MEMORY = 1.0
"""Time [s] for which a wrong command in a gap disturbs what follows.

Measured on bristle-friction benches.
"""
SLOPE_SLACK = 0.5
"""A gap is smooth if its mean slope lies between those around it, widened by this share of them."""


@dataclass(frozen=True, kw_only=True)
class Timeline:
    """One recording as a simulation sees it."""

    time: Array
    """Instants of the simulated rows [s], shape (S,) with S >= T."""
    command: Array
    """Commands in force from each of them on [rad], shape (S, D)."""
    measured: Indices
    """Index of each recorded row among the simulated ones, shape (T,)."""
    trusted: Mask
    """Whether the command's past is known well enough at each recorded row, shape (T,)."""


def make_timeline(recording: Recording) -> Timeline:
    """Fill the gaps of a recording.

    Args:
        recording: A recording with commands.

    Raises:
        InvalidRecording: It has none; to drive the mechanism by measured force is not possible yet.
    """
    if recording.command is None:
        raise InvalidRecording(
            f"{recording.name}: a simulation needs the command theta_d in every row; the recording "
            "has no such column, and driving the mechanism by its force alone is not possible yet"
        )
    time, command = recording.time, recording.command
    intervals = np.diff(time)
    period = float(np.median(intervals)) if len(intervals) else 1.0
    gaps = np.flatnonzero(intervals > GAP_RATIO * period)
    times, commands = [time[: gaps[0] + 1] if len(gaps) else time], [command]
    trusted = np.ones(len(time), dtype=bool)
    if len(gaps):
        commands = [command[: gaps[0] + 1]]
    for index, gap in enumerate(gaps):
        lost = round(intervals[gap] / period) - 1
        share = np.arange(1, lost + 1)[:, None] / (lost + 1)
        filled, smooth = fill_commands(time, command, int(gap), share)
        if not smooth:
            trusted[(time > time[gap]) & (time < time[gap + 1] + MEMORY)] = False
        end = gaps[index + 1] + 1 if index + 1 < len(gaps) else len(time)
        times += [time[gap] + share[:, 0] * intervals[gap], time[gap + 1 : end]]
        commands += [filled, command[gap + 1 : end]]
    every_time = np.concatenate(times)
    return Timeline(
        time=every_time,
        command=np.concatenate(commands),
        measured=np.searchsorted(every_time, time),
        trusted=trusted,
    )


def fill_commands(time: Array, command: Array, gap: int, share: Array) -> tuple[Array, bool]:
    """Return the commands lost after row ``gap``, and whether the command moved smoothly there."""
    before, after = command[gap], command[gap + 1]
    length = time[gap + 1] - time[gap]
    slope = (after - before) / length
    if 0 < gap < len(time) - 2:
        left = (before - command[gap - 1]) / (time[gap] - time[gap - 1])
        right = (command[gap + 2] - after) / (time[gap + 2] - time[gap + 1])
    else:
        left = right = slope
    slack = SLOPE_SLACK * np.maximum(np.abs(left), np.abs(right)) + 1.0e-9
    inside = (slope >= np.minimum(left, right) - slack) & (slope <= np.maximum(left, right) + slack)
    if not inside.all():
        return np.broadcast_to(before, (len(share), *before.shape)).copy(), False
    s2, s3 = share**2, share**3
    hermite = (
        (2 * s3 - 3 * s2 + 1) * before
        + (s3 - 2 * s2 + share) * length * left
        + (3 * s2 - 2 * s3) * after
        + (s3 - s2) * length * right
    )
    return hermite, True
