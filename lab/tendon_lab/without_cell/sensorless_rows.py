"""Rows that tell how the lines of benches differ: those in which the servo's gear slides.

Where the gear sticks, the servo has no say in the force. And a servo seen for long, or across a
reversal, would tell by its motion on which bench it is.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from tendon_lab.without_cell.sensorless_motion import SensorlessMotion
from tendon_newton.data.recording import Array, Indices
from tendon_newton.errors import InvalidDataset
from tendon_train.actuator.samples.servo_law import SLIDING
from tendon_train.actuator.samples.windows import WindowShape, window_rows

SHAPE = WindowShape(window=3, rate=20.0, pad_start=False)
"""What is seen of the servo: now, and one and two ticks of its loop ago. The force answers to the
command within these; 0.1 s is too short to tell a stiff bench from a soft one."""
TIP_STEP = 1.0e-5  # Step of a tip by which its joints' derivatives are taken [m]
STEEPEST = 200.0  # Largest such derivative that is used [rad/m]: a straight finger's is infinite
SPACING = 0.075  # Between two rows that are used [s]; nearer ones say the same


@dataclass(frozen=True, kw_only=True)
class SlidingRows:
    """N rows of all recordings, and what was seen at each."""

    servo: Tensor
    """theta_d - theta and theta_dot of the last instants, and which way it turns, in standard
    deviations, shape (N, 7)."""
    unwinds: Tensor  # 1 where the tendon drives the servo back, else 0, shape (N,)
    wound: Tensor  # Line on the spool [m], shape (N,)
    direction: Tensor  # From -1, paid out, to 1, wound in [1], shape (N,)
    joints: Tensor  # Joint angles [rad], shape (N, J); zeros for missing joints
    joints_by_tip: Tensor
    """Derivatives of the joint angles by x and z of the seen tip [rad/m], shape (N, J, 2)."""
    bench: Tensor  # Number of each row's bench, shape (N,)
    weight: Tensor  # One over the number of rows of the same recording [1], shape (N,)


def sliding_rows(motions: Sequence[SensorlessMotion], benches: Sequence[str]) -> SlidingRows:
    """Put the rows in which gears slide one after the other.

    Raises:
        InvalidDataset: There are none.
    """
    joint_count = max(motion.joints.shape[1] for motion in motions)
    servo, seen, slopes, bench, weight = [], [], [], [], []
    for motion in motions:
        windows = sliding_windows(motion)
        last = windows[:, -1]
        signals = servo_signals(motion)[windows]
        turning = np.sign(signals[:, -1, 1])
        servo.append(np.column_stack([signals[:, :, 0], signals[:, :, 1], turning]))
        missing = (0, joint_count - motion.joints.shape[1])
        joints = np.pad(motion.joints, ((0, 0), missing))
        slopes.append(np.pad(joints_by_tip(motion), ((0, 0), missing, (0, 0)))[last])
        seen.append(np.column_stack([motion.wound, motion.direction, joints])[last])
        bench.append(np.full(last.size, benches.index(motion.recording.bench)))
        weight.append(np.full(last.size, 1.0 / max(1, last.size)))
    table, places = np.concatenate(servo), np.concatenate(seen)
    if not len(table):
        raise InvalidDataset(
            f"without a load cell benches are compared where the servo turns one way at "
            f"{SLIDING:g} rad/s or more for 0.1 s; none of {len(motions)} recordings has one"
        )
    turning = table[:, -1]
    table = (table - table.mean(axis=0)) / np.maximum(table.std(axis=0), 1.0e-6)
    return SlidingRows(
        servo=torch.tensor(table, dtype=torch.float32),
        unwinds=torch.tensor(turning < 0.0, dtype=torch.int64),
        wound=torch.tensor(places[:, 0], dtype=torch.float32),
        direction=torch.tensor(places[:, 1], dtype=torch.float32),
        joints=torch.tensor(places[:, 2:], dtype=torch.float32),
        joints_by_tip=torch.tensor(np.concatenate(slopes), dtype=torch.float32),
        bench=torch.tensor(np.concatenate(bench)),
        weight=torch.tensor(np.concatenate(weight), dtype=torch.float32),
    )


def servo_signals(motion: SensorlessMotion) -> Array:
    """Return theta_d - theta [rad] and theta_dot [rad/s], shape (T, 2)."""
    recording = motion.recording
    assert recording.command is not None
    lead = recording.command[:, 0] - recording.motor_position[:, 0]
    return np.column_stack([lead, recording.motor_velocity[:, 0]])


def joints_by_tip(motion: SensorlessMotion) -> Array:
    """Return derivatives of the joint angles by x and z of the seen tip [rad/m], (T, J, 2)."""
    sides = [
        motion.joints_seen_by((-TIP_STEP, 0.0)) - motion.joints_seen_by((TIP_STEP, 0.0)),
        motion.joints_seen_by((0.0, -TIP_STEP)) - motion.joints_seen_by((0.0, TIP_STEP)),
    ]
    return np.clip(np.stack(sides, axis=2) / (2.0 * TIP_STEP), -STEEPEST, STEEPEST)


def sliding_windows(motion: SensorlessMotion) -> Indices:
    """Return windows from whose first to whose last row the servo turns one way, shape (W, 3)."""
    recording = motion.recording
    windows = window_rows(recording, SHAPE)
    speed = recording.motor_velocity[:, 0]
    way = np.sign(speed) * (np.abs(speed) > SLIDING)
    turns = np.concatenate([[0], np.cumsum(way[1:] != way[:-1])])
    steady = (turns[windows[:, 0]] == turns[windows[:, -1]]) & (way[windows[:, -1]] != 0.0)
    stride = max(1, round(SPACING / float(np.median(np.diff(recording.time)))))
    return windows[steady][::stride]
