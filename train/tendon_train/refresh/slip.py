"""How far a spool has slipped: by the turning effort then and now, or by rows surely taut."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import pi

import numpy as np
from scipy.signal import savgol_filter

from tendon_newton.data.model_file import Model, NamedValues
from tendon_newton.data.recording import Array, Recording
from tendon_newton.diagnosis.search.search_worlds import SEARCH_STEP
from tendon_newton.identification.objective import loss_terms
from tendon_newton.identification.study import Study, replacements
from tendon_train.refresh.refresh_logs import LOOSE

SLIP = "position_offset"
SLIPS = (SLIP, "tendon_slack")
"""Causes that leave the tendon loose at home; logs hardly tell one from the other."""
GRIDS = ((0.9, 0.05), (0.06, 0.005))
"""Half width and step of the offsets that are tried about the best one so far [rad]."""
UNIT = 0.01
"""Error of the motor's angle that counts as one [rad]: the size that it has on a new bench."""
MARGIN = 0.05  # Angle above that of the open finger from which on a tendon counts as taut [rad]
OPEN = 0.02  # Share of the simulated angles that lie below that of the open finger [1]
ROUNDS = 20
LEAST_SHARE = 0.1  # Share of rows that must be left to say anything [1]


@dataclass(frozen=True, kw_only=True)
class SlipComparison:
    """Logs and what a model with each of N offsets makes of them."""

    offset: Array  # Tried offsets [rad], shape (N,)
    angle: Array  # Measured motor angles [rad], shape (T,)
    error: Array  # Measured minus simulated angles [rad], shape (N, T)

    @property
    def open_angle(self) -> Array:
        """Simulated angle of the open finger with each offset [rad], shape (N,)."""
        return np.quantile(self.angle - self.error, OPEN, axis=1)


@dataclass(frozen=True, kw_only=True)
class Slip:
    """Angle by which a spool has slipped."""

    offset: float  # Offset of the encoder's zero against the mechanism's [rad]
    # What the encoder says of the open finger [rad]; below it the tendon hangs loose
    open_angle: float


def with_slip(
    recordings: Sequence[Recording], model: Model, reference: Sequence[Recording] = ()
) -> Model:
    """Return a model whose encoder's zero fits logs of a bench whose spool has slipped.

    Nothing else is fitted: it was right when the bench was new. Logs of that time say how far the
    spool has slipped since, whatever the model's own error is; without them the model has to.

    Args:
        model: Model that fitted the bench before the spool slipped.
        reference: Logs from that time.
    """
    slip = slip_since(reference, recordings) if reference else None
    if slip is None:
        offset = find_slip(recordings, model).offset
    else:
        own = (effect.values["angle"] for effect in model.effects if effect.name == SLIP)
        offset = slip + float(next(own, 0.0))
    others = without(model, SLIP)
    named = NamedValues(name=SLIP, values={"angle": offset})
    return replace(others, effects=(*others.effects, named))


def taut_from(recordings: Sequence[Recording], model: Model) -> float:
    """Return the motor angle from which on the tendon certainly is taut [rad]."""
    return max(LOOSE, find_slip(recordings, model).open_angle + MARGIN)


def find_slip(recordings: Sequence[Recording], model: Model) -> Slip:
    """Find how far the spool has slipped, if at all.

    A motor below the angle at which the finger is open has let its tendon hang loose and says
    nothing of where home is. The choice of these rows depends on the offset, so that rows and
    offset are found in turn.

    Args:
        model: Model that fitted the bench when it was new.
    """
    others = without(model, SLIP)
    names = (*(effect.name for effect in others.effects), SLIP)
    study = Study(recordings, replace(others, fit=()), names, time_step=SEARCH_STEP)
    (column,) = study.table.columns(SLIP)
    found = Slip(offset=0.0, open_angle=0.0)
    for width, step in GRIDS:
        tried = compare(study, column, found.offset + np.arange(-width, width + step / 2.0, step))
        best = best_offset(tried, found.offset)
        found = Slip(offset=float(tried.offset[best]), open_angle=float(tried.open_angle[best]))
    return found


def compare(study: Study, column: int, tried: Array) -> SlipComparison:
    """Simulate all logs with each of some offsets [rad]."""
    found = study.residuals(*replacements([{column: float(value)} for value in tried]))
    return SlipComparison(
        offset=tried,
        angle=np.concatenate([log.motor_position[:, 0] for log in study.recordings]),
        error=np.concatenate([residual.theta for residual in found], axis=1),
    )


def best_offset(tried: SlipComparison, start: float) -> int:
    """Return the place of the offset that explains best the rows that are taut with it.

    Args:
        tried: Offsets and what comes of them.
        start: Offset to begin with [rad].
    """
    best = int(np.argmin(np.abs(tried.offset - start)))
    loss, bounds = loss_terms(tried.error / UNIT), tried.open_angle + MARGIN
    for _ in range(ROUNDS):
        taut = tried.angle > bounds[best]
        if np.mean(taut) < LEAST_SHARE:
            break
        found = int(np.argmin(loss[:, taut].sum(axis=1)))
        if found == best:
            break
        best = found
    return best


def without(model: Model, name: str) -> Model:
    """Return a model without an effect."""
    return replace(model, effects=tuple(e for e in model.effects if e.name != name))


WINDOW = 0.14  # Length over which angles become rates and accelerations [s]
LEAST_RATE = 0.2
"""Rate from which on the gear certainly turns [rad/s]: at rest, its friction holds any pull."""
LEAST_ROWS = 200  # Turning rows without which logs say nothing
FIRST_KNOT, KNOT = 0.1, 0.15
"""Angle of the first knot of the pull [rad], below which no tendon pulls, and between knots."""
RIDGE = 1.0e-3  # Squared weight that keeps the pull's bends small [1]
MATCH_ROUNDS = 15  # Fits in turn with the weights of their rows
TRIED = np.arange(-180, 181) * 5.0e-3  # Slips that are tried [rad]


@dataclass(frozen=True, kw_only=True)
class ReferenceTurning:
    """Rows in which the spool turns."""

    # What the host asks for beyond the motor's angle [rad], shape (T,): the duty, scaled
    lead: Array
    angle: Array  # Angle of the motor [rad], shape (T,)
    rate: Array  # Speed of the motor [rad/s], shape (T,)
    acceleration: Array  # Acceleration of the motor [rad/s^2], shape (T,)


@dataclass(frozen=True, kw_only=True)
class PullCurve:
    """Lead that turning takes, by angle: the pull of a tendon, with no model of what it pulls at.

    The lead grows with acceleration, with rate and with the pull; friction, and the pull that
    friction lets through, differ by direction.
    """

    knots: Array  # Angles at which the pull's slope may change [rad]
    weights: Array  # Factors of `terms`
    scale: float  # Usual error of the lead [rad]


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
    knots = np.arange(FIRST_KNOT, min(float(turning.angle.max()), 2.0 * pi), KNOT)
    columns = terms(turning, knots, 0.0)
    bends = np.sqrt(RIDGE) * np.eye(columns.shape[1])[4:]
    target = np.r_[turning.lead, np.zeros(len(bends))]
    share, scale = np.ones(turning.lead.size), 1.0
    weights = np.zeros(columns.shape[1])
    for _ in range(MATCH_ROUNDS):
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
