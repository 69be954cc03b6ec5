"""How far a spool has slipped, from what it takes to turn it: on a new bench, and later."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi

import numpy as np
from scipy.signal import savgol_filter

from tendon_newton.data.recording import Array, Recording
from tendon_newton.identification.objective import loss_terms

WINDOW = 0.14
"""Length over which angles become rates and accelerations [s]."""
LEAST_RATE = 0.2
"""Rate from which on the gear certainly turns [rad/s]: at rest, its friction holds any pull."""
LEAST_ROWS = 200
"""Turning rows without which logs say nothing."""
LOOSE, KNOT = 0.1, 0.15
"""Angle of the first knot of the pull [rad], below which no tendon pulls, and between knots."""
RIDGE = 1.0e-3
"""Squared weight that keeps the pull's bends small [1]."""
ROUNDS = 15
"""Fits in turn with the weights of their rows."""
TRIED = np.arange(-180, 181) * 5.0e-3
"""Slips that are tried [rad]."""


@dataclass(frozen=True, kw_only=True)
class ReferenceTurning:
    """Rows in which the spool turns."""

    lead: Array
    """What the host asks for beyond the motor's angle [rad], shape (T,): the duty, scaled."""
    angle: Array
    """Angle of the motor [rad], shape (T,)."""
    rate: Array
    """Speed of the motor [rad/s], shape (T,)."""
    acceleration: Array
    """Acceleration of the motor [rad/s^2], shape (T,)."""


@dataclass(frozen=True, kw_only=True)
class PullCurve:
    """Lead that turning takes, by angle: the pull of a tendon, with no model of what it pulls at.

    The lead grows with acceleration, with rate and with the pull; friction, and the pull that
    friction lets through, differ by direction.
    """

    knots: Array
    """Angles at which the pull's slope may change [rad]."""
    weights: Array
    """Factors of `terms`."""
    scale: float
    """Usual error of the lead [rad]."""


def slip_since(earlier: Sequence[Recording], later: Sequence[Recording]) -> float | None:
    """Return how far a spool has slipped between logs [rad]; None if too little turns in them.

    A spool that has slipped by some angle needs the same lead as before, farther on by that angle.

    Args:
        earlier: Logs from when the bench was new, angles alone.
        later: Logs from after the slip.
    """
    if any(log.command is None for log in (*earlier, *later)):
        return None
    new, now = turning_rows(earlier), turning_rows(later)
    if min(new.angle.size, now.angle.size) < LEAST_ROWS:
        return None
    curve = fit_curve(new)
    losses = [loss_terms(errors(curve, now, slip) / curve.scale).sum() for slip in TRIED]
    return float(TRIED[int(np.argmin(losses))])


def turning_rows(recordings: Sequence[Recording]) -> ReferenceTurning:
    """Return the rows of logs in which the first motor turns."""
    parts = [smoothed(recording) for recording in recordings]
    lead, angle, rate, acceleration = np.concatenate(
        [part[:, np.abs(part[2]) > LEAST_RATE] for part in parts], axis=1
    )
    return ReferenceTurning(lead=lead, angle=angle, rate=rate, acceleration=acceleration)


def smoothed(recording: Recording) -> Array:
    """Return lead, angle, rate and acceleration of the first motor, shape (4, T)."""
    assert recording.command is not None
    step = float(np.median(np.diff(recording.time)))
    rows = max(2 * int(0.5 * WINDOW / step) + 1, 5)
    if recording.sample_count <= 2 * rows:
        return np.zeros((4, 0))
    angle = recording.motor_position[:, 0]
    lead = recording.command[:, 0] - angle
    derivatives = [
        np.asarray(savgol_filter(angle, rows, 2, order, delta=step)) for order in range(3)
    ]
    return np.stack([np.asarray(savgol_filter(lead, rows, 2)), *derivatives])[:, rows:-rows]


def fit_curve(turning: ReferenceTurning) -> PullCurve:
    """Fit the curve, rows that lie off it counting less."""
    knots = np.arange(LOOSE, min(float(turning.angle.max()), 2.0 * pi), KNOT)
    columns = terms(turning, knots, 0.0)
    bends = np.sqrt(RIDGE) * np.eye(columns.shape[1])[4:]
    target = np.r_[turning.lead, np.zeros(len(bends))]
    share, scale = np.ones(turning.lead.size), 1.0
    weights = np.zeros(columns.shape[1])
    for _ in range(ROUNDS):
        root = np.r_[np.sqrt(share), np.ones(len(bends))]
        rows = np.concatenate([columns, bends]) * root[:, None]
        weights = np.linalg.lstsq(rows, target * root)[0]
        error = np.abs(turning.lead - columns @ weights)
        # 1.4826: from the median to the deviation of normal errors, of which 1.5 count in full
        scale = max(1.4826 * float(np.median(error)), 1.0e-9)
        share = 1.0 / np.maximum(1.0, error / (1.5 * scale))
    return PullCurve(knots=knots, weights=weights, scale=scale)


def errors(curve: PullCurve, turning: ReferenceTurning, slip: float) -> Array:
    """Return what the lead differs by from that of a spool that has slipped [rad]."""
    return turning.lead - terms(turning, curve.knots, slip) @ curve.weights


def terms(turning: ReferenceTurning, knots: Array, slip: float) -> Array:
    """Return what the lead is made of, shape (T, 4 + two for each knot)."""
    winding = np.where(turning.rate > 0.0, 1.0, 0.0)
    ways = np.stack([winding, 1.0 - winding], axis=1)
    bends = np.maximum(0.0, (turning.angle - slip)[:, None] - knots)
    return np.concatenate(
        [
            np.stack([turning.acceleration, turning.rate], axis=1),
            ways,
            bends * ways[:, :1],
            bends * ways[:, 1:],
        ],
        axis=1,
    )
