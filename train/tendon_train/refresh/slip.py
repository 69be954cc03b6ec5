"""How far a spool has slipped: from logs of the new bench, or rows that certainly are taut."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tendon_newton.data.model_file import Model, NamedValues
from tendon_newton.data.recording import Array, Recording
from tendon_newton.diagnosis.search.search_worlds import SEARCH_STEP
from tendon_newton.identification.objective import loss_terms
from tendon_newton.identification.study import Study, replacements
from tendon_train.refresh.refresh_logs import LOOSE
from tendon_train.refresh.slip_by_reference import slip_since

SLIP = "position_offset"
SLIPS = (SLIP, "tendon_slack")
"""Causes that leave the tendon loose at home; logs hardly tell one from the other."""
GRIDS = ((0.9, 0.05), (0.06, 0.005))
"""Half width and step of the offsets that are tried about the best one so far [rad]."""
UNIT = 0.01
"""Error of the motor's angle that counts as one [rad]: the size that it has on a new bench."""
MARGIN = 0.05
"""Angle above that of the open finger from which on a tendon counts as taut [rad]."""
OPEN = 0.02
"""Share of the simulated angles that lie below that of the open finger [1]."""
ROUNDS = 20
LEAST_SHARE = 0.1
"""Share of rows that must be left to say anything [1]."""


@dataclass(frozen=True, kw_only=True)
class SlipComparison:
    """Logs and what a model with each of N offsets makes of them."""

    offset: Array
    """Tried offsets [rad], shape (N,)."""
    angle: Array
    """Measured motor angles [rad], shape (T,)."""
    error: Array
    """Measured minus simulated angles [rad], shape (N, T)."""

    @property
    def open_angle(self) -> Array:
        """Simulated angle of the open finger with each offset [rad], shape (N,)."""
        return np.quantile(self.angle - self.error, OPEN, axis=1)


@dataclass(frozen=True, kw_only=True)
class Slip:
    """Angle by which a spool has slipped."""

    offset: float
    """Offset of the encoder's zero against the mechanism's [rad]."""
    open_angle: float
    """What the encoder says of the open finger [rad]; below it the tendon hangs loose."""


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
