"""Whether motor and tension of a recording agree by a model's mechanism, row by row.

The measured tension drives the mechanism: between where that says that the motor should be and
where it is, a string that slips leaves a step and a knock a pulse. What befalls the servo leaves
nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import maximum_filter1d, median_filter

from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Array, Recording
from tendon_newton.diagnosis.search.search_worlds import SEARCH_STEP
from tendon_newton.identification.study import Study, replacements
from tendon_newton.simulation.hosts.replay import bench_of
from tendon_newton.simulation.model.parameter_table import spool_radius_of

SIDE = 2.0  # Time either side of a step, at least [s]: twice a knock, and more
PULSE = 1.0  # Greatest length of a knock [s]
WIDTHS = (0.3, 1.0, 3.0)
"""Changes of tension in which a friction turns round [N], on a nominal bench."""
MEMORY = 2.0
"""Time for which springs remember a tension, and a run its beginning [s]: 0.7 to 1.2 s and more on
virtual benches, a choice."""
JERK = 2  # Rows in which a string slips or a knock sets in: a knock takes 20 ms
CALM = 0.1
"""Time for which a change of the command's pace jerks a bench [s]: five rows, on virtual ones."""


@dataclass(frozen=True, kw_only=True)
class Balance:
    """Whether motor and tension of a recording agree by the model's mechanism.

    Rows begin when a change of tension has told which way friction points.
    """

    name: str  # Of the recording, with the servo where there are several
    source: tuple[int, int]  # Which of all recordings it is, and which servo
    time: Array  # Since the recording's first row [s], shape (T,)
    offset: Array  # Angle of the motor beyond what its tension leaves it [rad], shape (T,)
    tension: Array  # At the load cell [N], shape (T,)
    turns: Array  # Changes of the command's pace around each row [rad], shape (T,)
    radius: float  # Of the spool, as it is stated [m]; one on a shaft
    follows: Array
    """What a model's error on a mechanism follows: the tension, which way frictions point, and what
    is remembered, shape (T, P)."""

    def less(self, usual: Array) -> Balance:
        """Return it without the model's usual error, which follows what it follows, shape (P,)."""
        return replace(self, offset=self.offset - self.follows @ usual)


def commanded(recordings: Sequence[Recording]) -> list[Recording]:
    """Return the recordings in which a command drives the bench."""
    return [r for r in recordings if r.driven_by == "command"]


def with_cell(recordings: Sequence[Recording]) -> list[Recording]:
    """Return those of them that have a load cell."""
    return [r for r in commanded(recordings) if r.force is not None]


def balances(recordings: Sequence[Recording], model: Model) -> list[Balance]:
    """Let the measured tensions drive a model's mechanism."""
    if not recordings:
        return []
    study = driven_mechanism(recordings, model)
    stated = spool_radius_of(model)
    tendons = {r.bench: bench_of(r.bench, model).tendons for r in recordings}
    residuals = study.residuals(*replacements([{}]))
    out = list[Balance]()
    for own, (i, d), residual in zip(study.recordings, study.sources, residuals, strict=True):
        command = recordings[i].command
        assert own.force is not None
        assert command is not None
        force = own.force[:, 0]
        offset = residual.theta[0]
        size = force / WIDTHS[-1]
        columns = [np.ones_like(force), size, size**2, size**3, size**4]
        for width in WIDTHS:
            way = turned(force, width)
            columns += [way, way * size, way * size**2]
        since = own.time - own.time[0]
        columns += [size - lagged(since, size, MEMORY), np.exp(-since / MEMORY)]
        radius = stated or tendons[own.bench][d].spool_radius
        told = np.flatnonzero(np.abs(turned(force, WIDTHS[1])) >= 1.0)
        rows = slice(int(told[0]), None) if len(told) else slice(0, 0)
        if len(offset[rows]) > 1:
            out.append(
                Balance(
                    name=own.name,
                    source=(i, d),
                    time=(own.time - own.time[0])[rows],
                    offset=offset[rows],
                    tension=force[rows],
                    turns=turns(own.time, command[:, d])[rows],
                    radius=radius,
                    follows=np.stack(columns, axis=1)[rows],
                )
            )
    return out


def pushed_offsets(
    sources: Sequence[tuple[int, int]],
    pushes: Sequence[Array],
    recordings: Sequence[Recording],
    model: Model,
) -> list[Array]:
    """Return offsets of the motor's angle where something pushes beside the tension [rad].

    Args:
        sources: Which recording, and which servo's mechanism is pushed.
        pushes: Forces along the tendon that are tried, positive where they close the mechanism [N],
            shape (N, T) each, of a recording's last T rows.

    Returns:
        Motor beyond where tension and push leave it, as the pushes.
    """
    if not sources:
        return []
    tried = [
        pushed(recordings[i], d, push)
        for (i, d), own in zip(sources, pushes, strict=True)
        for push in own
    ]
    study = driven_mechanism(tried, model)
    residuals = dict(zip(study.sources, study.residuals(*replacements([{}])), strict=True))
    servos = [d for (_, d), own in zip(sources, pushes, strict=True) for _ in own]
    offsets = iter([residuals[n, d].theta[0] for n, d in enumerate(servos)])
    return [np.stack([next(offsets)[-len(push) :] for push in own]) for own in pushes]


def pushed(recording: Recording, servo: int, push: Array) -> Recording:
    """Return a recording with a force more on a servo's mechanism in its last rows [N]."""
    assert recording.force is not None
    force = recording.force.copy()
    force[-len(push) :, servo] += push
    return replace(recording, force=force)


def driven_mechanism(recordings: Sequence[Recording], model: Model) -> Study:
    """Return recordings whose tensions drive a model's mechanism."""
    causes = tuple(effect.cause for effect in model.effects)
    driven = [replace(recording, command=None) for recording in recordings]
    return Study(driven, model, causes, time_step=SEARCH_STEP)


def lagged(time: Array, signal: Array, memory: float) -> Array:
    """Return what follows a signal with a time constant [s], shape (T,)."""
    out, now = np.empty_like(signal), float(signal[0])
    kept = np.exp(-np.diff(time, prepend=time[0]) / memory)
    for k, (own, share) in enumerate(zip(signal, kept, strict=True)):
        out[k] = now = own + share * (now - own)
    return out


def turned(signal: Array, width: float) -> Array:
    """Return which way a friction points that a change by a width turns round, -1 to 1, shape (T,).

    The signal is a force, or a length that slips through a guide.
    """
    out, now = np.zeros_like(signal), 0.0
    for k, change in enumerate(np.diff(signal), start=1):
        now = min(1.0, max(-1.0, now + change / width))
        out[k] = now
    return out


def usual_error(calm: Sequence[Balance]) -> Array:
    """Return how a model's error follows tension where nothing happened, shape (P,)."""
    follows = np.concatenate([own.follows for own in calm])
    offset = np.concatenate([own.offset for own in calm])
    return np.linalg.lstsq(follows, offset, rcond=None)[0].astype(np.float64)


def falls(own: Balance) -> Array:
    """Return how far the tension falls in `JERK` rows [N], shape (T,)."""
    fall = np.zeros_like(own.tension)
    fall[JERK:] = own.tension[:-JERK] - own.tension[JERK:]
    return fall


def turns(time: Array, command: Array) -> Array:
    """Return how far the command's pace changes around each row [rad], shape (T,).

    A beginning counts as a step over all that is asked for.
    """
    rows = rows_in(time, 0.5 * CALM)
    pace = np.full_like(command, np.ptp(command))
    pace[rows:-rows] = command[2 * rows :] - 2.0 * command[rows:-rows] + command[: -2 * rows]
    return maximum_filter1d(np.abs(pace), 4 * rows + 1)


def rows_in(time: Array, length: float) -> int:
    """Return the rows of a time [s]."""
    return round(length / float(np.median(np.diff(time))))


def pulses(own: Balance) -> Array:
    """Return how far the offset stands out of a while around each row [rad], shape (T,)."""
    return own.offset - median_filter(own.offset, 2 * rows_in(own.time, PULSE) + 1)


def size_of_step(own: Balance, calm: Sequence[Balance], at: int) -> float:
    """Return how far the offset rises for good at a row [rad], beside the model's usual error.

    Before it the offset is that of the calm day, unless more than `SIDE` of rows says otherwise.
    What follows within `PULSE` is not heard: it may be a knock's.
    """
    heard = (np.arange(len(own.time)) < at) | (own.time >= own.time[at] + PULSE)
    nothing = [np.zeros((len(other.offset), 2)) for other in calm]
    still = rows_in(own.time, SIDE)
    after = np.concatenate([np.zeros(still), (np.arange(len(own.time)) >= at)[heard]])
    before = replace(
        own,
        offset=np.concatenate([np.zeros(still), own.offset[heard]]),
        follows=np.concatenate([np.zeros((still, own.follows.shape[1])), own.follows[heard]]),
    )
    levels = (*nothing, np.column_stack([np.ones(len(after)), after]))
    with_levels = [
        replace(other, follows=np.column_stack([other.follows, level]))
        for other, level in zip((*calm, before), levels, strict=True)
    ]
    return float(usual_error(with_levels)[-1])
