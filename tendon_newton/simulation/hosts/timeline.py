"""The rows that a simulation visits: those of a recording, and those that its log lost.

A bench goes on hearing commands while its log has a gap. Where the command moved smoothly before
and after, the lost commands are interpolated; where it jumped, the last one is held, and the rows
that follow cannot be trusted.

A log that begins with a jump of the command gets a row before all others, in which what had been
commanded before is in force: delays, lags and profiles begin with that.

Without commands the measured force drives the mechanism. A row is measured just after its command
took effect, so that the force of a servo jumps at rows and sags between them, by its stiffness
times the way that the shaft goes. To hold it would be taken for damping, at 80 Hz for half as much
again as a finger has; to join rows by straight lines, for more.
"""

from dataclasses import dataclass, replace

import numpy as np

from tendon_newton.data.checks.first_rows import first_row
from tendon_newton.data.recording import Array, Indices, Mask, Recording

GAP_RATIO = 1.5  # An interval this many times longer than the median has lost rows
MEMORY = 1.0
"""Time [s] for which a wrong command in a gap disturbs what follows.

Measured on bristle-friction benches.
"""
# A gap is smooth if its mean slope lies between those around it, widened by this share of them
SLOPE_SLACK = 0.5
LEAD = 1.0e-5  # Time [s] of the row before all others: nothing moves, and it is another instant
FORCE_PARTS = 4  # Steps per row by which a sagging force is drawn


@dataclass(frozen=True, kw_only=True)
class Timeline:
    """One recording as a simulation sees it."""

    time: Array  # Instants of the simulated rows [s], shape (S,) with S >= T
    # Commands in force from each of them on [rad], or measured forces [N], shape (S, D)
    command: Array
    measured: Indices  # Index of each recorded row among the simulated ones, shape (T,)
    # Whether the command's past is known well enough at each recorded row, shape (T,)
    trusted: Mask
    motion: Array | None = None  # Rate and acceleration of a led shaft [rad/s, rad/s2], (S, 2)

    def without_past(self) -> "Timeline":
        """Return the timeline from its first measured row on."""
        first = int(self.measured[0])
        return replace(self, time=self.time[first:], command=self.command[first:],
                       measured=self.measured - first)  # fmt: skip


def make_timeline(recording: Recording, stiffness: float = 0.0) -> Timeline:
    """Fill the gaps of a recording; without commands draw its force.

    The stiffness is by how much the servo answers a turn of its shaft between rows [N/rad].
    """
    time, command = recording.time, recording.command
    if command is None:
        return force_timeline(recording, stiffness)
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
    begin = first_row(recording)
    if recording.start == "first_row" and begin.before is not None:
        trusted[time < time[0] + begin.doubtful] = False
        if (begin.before != command[0]).any():
            times, commands = [time[:1] - LEAD, *times], [begin.before[None], *commands]
    every_time = np.concatenate(times)
    return Timeline(
        time=every_time,
        command=np.concatenate(commands),
        measured=np.searchsorted(every_time, time),
        trusted=trusted,
    )


def force_timeline(recording: Recording, stiffness: float) -> Timeline:
    """Let each row's force sag until the next; rows after a gap cannot be trusted."""
    assert recording.force is not None, "a recording has commands or forces"
    time, force = recording.time, recording.force
    intervals = np.diff(time)
    share = np.arange(FORCE_PARTS) / FORCE_PARTS
    moved = (
        np.diff(recording.motor_position, axis=0)[:, None] * (share + 0.5 / FORCE_PARTS)[:, None]
    )
    sagging = force[:-1, None] - stiffness * moved
    trusted = np.ones(len(time), dtype=bool)
    for gap in np.flatnonzero(intervals > GAP_RATIO * np.median(intervals)):
        trusted[(time > time[gap]) & (time < time[gap + 1] + MEMORY)] = False
    return Timeline(
        time=np.append((time[:-1, None] + intervals[:, None] * share).ravel(), time[-1]),
        command=np.concatenate([sagging.reshape(-1, force.shape[1]), force[-1:]]),
        measured=np.arange(len(time)) * FORCE_PARTS,
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
