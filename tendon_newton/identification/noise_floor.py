"""The noise of encoder and load cell, estimated from the data alone."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from tendon_newton.data.checks.measures import difference_noise, encoder_count, encoder_noise
from tendon_newton.data.recording import Array, Recording
from tendon_newton.identification.load_cell import reading_stride

QUIET_WINDOWS = (0.4, 0.8, 1.6)
"""Lengths [s] of windows in which neither command nor encoder moves.

Slow noise shows in the long ones only.
"""
QUIET_LEAD = 0.3
"""Time [s] of rest before such a window: behind a stuck tendon the mechanism comes to rest late."""
MIN_WINDOWS = 5  # Windows without which the scatter at rest is not trusted
MIN_READINGS = 8  # Readings of the cell without which a window says nothing
MIN_LEVELS = 4  # Values of a force in counts: dry friction alone has one each way and one at rest
LEAST_FORCE_NOISE = 1.0e-6  # A noiseless (simulated) force still has rounding [N]
HARDLY_ANY = 0.02
"""Share of the largest gap of a signal, in squares of its floor, below which one is none [1]."""


@dataclass(frozen=True, kw_only=True)
class NoiseFloor:
    """Standard deviations of what no model could predict."""

    theta: float  # Motor angle [rad]
    force: float | None  # Tension [N]; None without a load cell
    others: Mapping[str, float] = field(default_factory=dict[str, float])
    """Further signals that were recorded, each in its unit."""

    def of(self, signal: str) -> float:
        """Return the noise of one signal, in its unit; 0 where it was not recorded."""
        known = {"theta": self.theta, "force": self.force or 0.0, **self.others}
        return known.get(signal, 0.0)


def angle_noise(recordings: Sequence[Recording]) -> float:
    """Return the noise of encoders [rad]: that of their step, a twelfth of its square."""
    theta = [
        encoder_noise(r.motor_position[:, d] if r.driven_by != "path" else r.compared_angle)
        for r in recordings
        for d in range(r.tendon_count)
    ]
    return float(np.median(theta))


def force_noise(recordings: Sequence[Recording]) -> float | None:
    """Return the noise of load cells [N], None without one.

    It is their scatter while command and encoder rest, in the longest windows of which there are
    enough, so that slow (coloured) noise counts; failing that, of their second differences. On a
    path that is led, where no error of form hides it, it is at least that of the force's counts.
    """
    with_force = [r for r in recordings if r.force is not None]
    if not with_force:
        return None
    scatter = float(np.median([difference_noise(new_readings(r)) for r in with_force]))
    counted = float(np.median([force_count(r) for r in with_force]) / np.sqrt(12.0))
    for length in QUIET_WINDOWS:
        quiet = [v for r in with_force for v in quiet_variances(r, length)]
        if len(quiet) >= MIN_WINDOWS:
            scatter = float(np.sqrt(np.median(quiet)))
    return max(scatter, counted, LEAST_FORCE_NOISE)


def cell_stride(recording: Recording) -> int:
    """Return how many rows a recording has per reading of its load cell."""
    rate = recording.load_cell_rate
    return 1 if rate is None else reading_stride(rate, recording.time)


def cell_readings(recording: Recording) -> Array:
    """Return the force at the rows on which the cell was read, or one in so many, shape (T',)."""
    assert recording.force is not None
    return recording.force[:: cell_stride(recording), 0]


def new_readings(recording: Recording) -> Array:
    """Return the readings of the cell, without those that a led path's slow sensor held.

    Such a sensor's values hardly recur; those of counts and of dry friction do.
    """
    readings = cell_readings(recording)
    new = readings[np.diff(readings, prepend=np.inf) != 0.0]
    is_held = len(np.unique(new)) > max(MIN_READINGS, 0.5 * len(new))
    return new if is_held and recording.driven_by == "path" else readings


def force_count(recording: Recording) -> float:
    """Return the count of a force on a path that is led [N]; 0 elsewhere, and where it has none."""
    readings = cell_readings(recording)
    if recording.driven_by != "path" or (count := encoder_count(readings)) == 0.0:
        return 0.0
    return count if len(np.unique(np.round(readings / count))) >= MIN_LEVELS else 0.0


def quiet_variances(recording: Recording, window: float) -> list[float]:
    """Return the variance of the force [N2] in each window [s] while command and encoder rest."""
    assert recording.force is not None
    time, angle = recording.time, recording.motor_position
    command = angle if recording.command is None else recording.command
    moved = np.zeros(len(time), dtype=bool)
    for signal in (command, angle):
        moved[1:] |= (np.abs(np.diff(signal, axis=0)) > 1.0e-9).any(axis=1)
    since = time - time[np.maximum.accumulate(np.where(moved, np.arange(len(time)), 0))]
    stride = cell_stride(recording)
    length = window * np.sqrt(stride)
    out = []
    start = 0
    while start < len(time):
        end = int(np.searchsorted(time, time[start] + length))
        if since[start] >= QUIET_LEAD and end < len(time) and not moved[start:end].any():
            readings = recording.force[start:end:stride, 0]
            if len(readings) >= MIN_READINGS:
                out.append(float(np.var(readings, ddof=1)))
            start = end
        else:
            start += 1
    return out


def share_gone(signals: Iterable[tuple[float, float, float]]) -> float | None:
    """Return the share of the squared error above the floor that is gone [1], from -1 on.

    Signals with a gap count alike; those with none, or hardly any beside the largest, for nothing.
    An error that grows counts by the largest gap: a small one may double at little harm.

    Args:
        signals: Error before and after, and the floor, of each signal [its unit].

    Returns:
        The share, or None where no error is above its floor.
    """
    gaps = [(top**2 / floor**2 - 1.0, (top**2 - left**2) / floor**2)
            for top, left, floor in signals if top > floor > 0.0]  # fmt: skip
    largest = max((size for size, _ in gaps), default=0.0)
    shares = [gone / (size if gone > 0.0 else largest)
              for size, gone in gaps if size >= HARDLY_ANY * largest]  # fmt: skip
    return float(np.clip(np.mean(shares), -1.0, 1.0)) if shares else None
