"""Windows of servo signals out of recordings of any rate, each with the force at its end."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from tendon_newton.data.recording import Array, Indices, Mask, Recording
from tendon_newton.errors import InvalidDataset, InvalidRecording

TOLERANCE = 0.6
"""Farthest that a row may lie from the instant of a sample, in median steps of the recording [1].
Half a step is the farthest where no row is missing; the rest is for uneven sampling."""
REST_SPEED = 0.05
"""Speed up to which a servo is at rest [rad/s]: two steps of a DYNAMIXEL X speed register
(0.229 rev/min, e-manual)."""


@dataclass(frozen=True, kw_only=True)
class WindowShape:
    """Length and rate of the window that a network sees."""

    window: int = 30  # Samples in a window
    rate: float = 20.0  # Samples per second [Hz]
    # Whether windows at the start of a recording that starts at rest repeat its first row
    # backwards: the rows before it would have been the same
    pad_start: bool = True


@dataclass(frozen=True, kw_only=True)
class Windows:
    """Rows of recordings, and which of them make up each window."""

    inputs: Array  # theta_d [rad], theta [rad], theta_dot [rad/s] of each row, shape (N, 3)
    force: Array  # Tension of each row [N], shape (N,)
    rows: Indices  # Rows of each window, oldest first, shape (W, window)
    # Series, one per recording and tendon in their order, of each window, shape (W,)
    source: Indices

    @property
    def window_count(self) -> int:
        """Windows W."""
        return int(self.rows.shape[0])

    @property
    def last(self) -> Indices:
        """Row at the end of each window, shape (W,)."""
        return self.rows[:, -1]


def extract_windows(recordings: Sequence[Recording], shape: WindowShape) -> Windows:
    """Cut every window out of some recordings; none reaches across a gap.

    Every row at which a window can end ends one, so that at 80 Hz and 20 Hz all four phases are
    there. A force that was filled in between the readings of a slow load cell is taken as logged.

    Raises:
        InvalidDataset: No recording has a window.
        InvalidRecording: One lacks a signal, or has fewer rows per second than a window samples.
    """
    inputs: list[Array] = []
    force: list[Array] = []
    rows: list[Indices] = []
    source: list[Indices] = []
    offset = 0
    for recording in recordings:
        found = window_rows(recording, shape)
        for tendon in range(recording.tendon_count):
            signals, tension = series(recording, tendon)
            inputs.append(signals)
            force.append(tension)
            rows.append(found + offset)
            source.append(np.full(found.shape[0], len(source)))
            offset += recording.sample_count
    if not sum(map(len, rows)):
        raise InvalidDataset(
            f"a window is {shape.window} samples at {shape.rate:g} Hz without a gap; none of "
            f"{len(recordings)} recordings has one"
        )
    return Windows(
        inputs=np.concatenate(inputs),
        force=np.concatenate(force),
        rows=np.concatenate(rows),
        source=np.concatenate(source),
    )


def series(recording: Recording, tendon: int) -> tuple[Array, Array]:
    """Return one tendon's inputs, shape (T, 3), and its tension [N], shape (T,).

    Raises:
        InvalidRecording: The command or the force was not recorded.
    """
    command, force = recording.command, recording.force
    if command is None or force is None:
        missing = "theta_d" if command is None else "force"
        raise InvalidRecording(
            f"{recording.name}: a force network learns from theta_d, theta, theta_dot and force; "
            f"{missing} is missing"
        )
    position, velocity = recording.motor_position, recording.motor_velocity
    columns = (command[:, tendon], position[:, tendon], velocity[:, tendon])
    return np.column_stack(columns), force[:, tendon]


def window_rows(recording: Recording, shape: WindowShape) -> Indices:
    """Return the rows of every window of a recording, shape (W, window).

    A sample is the row nearest to its instant. A window is left out if some sample has no row
    within the tolerance, or if the motor was off in it. A window with a step between
    rows that is longer than a sample is left out too.
    """
    time = recording.time
    step, interval = float(np.median(np.diff(time))), 1.0 / shape.rate
    if step > 1.2 * interval:
        raise InvalidRecording(
            f"{recording.name}: windows sample {shape.rate:g} times a second; "
            f"the recording has {1.0 / step:.3g} rows a second"
        )
    tolerance = TOLERANCE * step
    instants = time[:, None] - interval * np.arange(shape.window - 1, -1, -1)[None, :]
    rows = nearest_rows(time, instants)
    near = np.abs(time[rows] - instants) <= tolerance
    resting = np.all(np.abs(recording.motor_velocity[0]) <= REST_SPEED)
    if shape.pad_start and (recording.start == "equilibrium" or resting):
        near |= instants < time[0]  # nothing moved before the first row
    whole = near.all(axis=1) & unbroken(recording, rows[:, 0], interval + tolerance)
    return rows[whole]


def nearest_rows(time: Array, instants: Array) -> Indices:
    """Return the row nearest to each instant, any shape."""
    after = np.clip(np.searchsorted(time, instants), 1, time.size - 1)
    return after - (instants - time[after - 1] < time[after] - instants)


def unbroken(recording: Recording, first: Indices, longest: float) -> Mask:
    """Say for each row whether the rows from ``first`` up to it have no gap and the motor on."""
    broken = np.concatenate([[False], np.diff(recording.time) > longest])
    gaps = np.cumsum(broken)
    off = np.concatenate([[0], np.cumsum(~recording.enabled)])
    ends = np.arange(recording.sample_count)
    return (gaps[ends] == gaps[first]) & (off[ends + 1] == off[first])


@dataclass(frozen=True, kw_only=True)
class WindowTensors:
    """Rows and windows as tensors; a row is stored once, however many windows it is in."""

    inputs: Tensor  # theta_d [rad], theta [rad], theta_dot [rad/s] of each row, shape (N, 3)
    force: Tensor  # Tension of each row [N], shape (N,)
    rows: Tensor  # Rows of each window, oldest first, shape (W, window)

    def batch(self, chosen: Tensor) -> Tensor:
        """Return the chosen windows, shape (len(chosen), window, 3)."""
        return self.inputs[self.rows[chosen]]

    def targets(self, chosen: Tensor) -> Tensor:
        """Return the tension [N] at every sample of the chosen windows."""
        return self.force[self.rows[chosen]]


def to_device(windows: Windows, device: str) -> WindowTensors:
    """Put windows on a device."""
    return WindowTensors(
        inputs=torch.tensor(windows.inputs, dtype=torch.float32, device=device),
        force=torch.tensor(windows.force, dtype=torch.float32, device=device),
        rows=torch.tensor(windows.rows, dtype=torch.int64, device=device),
    )
