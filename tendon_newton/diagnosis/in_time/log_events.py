"""Events within recordings: a slip, a skip, a knock, a dip of the supply, with time and size.

The measured tension drives the model's mechanism, and says where the motor should be. A string that
slips and an angle that skips leave a step between that and where it is, a knock leaves a pulse, and
what befalls the servo leaves nothing. A dip of the supply shows in the voltage, where it is logged.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Array, Mask, Recording
from tendon_newton.diagnosis.search.search_worlds import SEARCH_STEP
from tendon_newton.identification.study import Study, replacements
from tendon_newton.simulation.hosts.replay import bench_of
from tendon_newton.simulation.model.parameter_table import spool_radius_of

Kind = Literal["slip", "skip", "knock", "dip"]
MARGIN, PULSE_MARGIN = 1.5, 2.0
"""How many times larger an event must be than anything on the day that the model knows [1]: a step
or a dip, and a knock, which a few rows make."""
SIDE = 2.0
"""Time either side of a step whose medians are compared [s]: twice a knock, and more."""
PULSE = 1.0
"""Greatest length of a knock [s]."""
WIDTHS = (0.3, 1.0, 3.0)
"""Changes of tension in which a friction turns round [N], on a nominal bench."""
ONSET, PLATEAU = 0.1, 0.7
"""Shares of a knock's peak from which it is there, and at its top [1]."""
CALM = 0.5
"""Time that a bench takes to settle after a step [s]."""
JUMP = 2
"""Rows in which an angle skips."""
LEAST_DIP = 0.03
"""Share of the supply that counts as missing on any day [1]: a register has tenths of a volt."""
LEAST_CALM = 2
"""Recordings without an event by which others are told, at least; each longer than twice `SIDE`."""


@dataclass(frozen=True, kw_only=True)
class Event:
    """Something that happened within a recording."""

    recording: str
    """Its name, with the servo where there are several."""
    kind: Kind
    start: float
    """Since the recording's first row [s]."""
    end: float | None
    """The same of its end; None where it stays."""
    size: float
    """Slack that came [m], jump of the angle [rad], force along the tendon (positive where it
    closes the mechanism) [N], or share of the supply that was lost [1]."""
    unit: str
    above: float
    """Size, in units of the greatest on the day that the model knows [1]."""


@dataclass(frozen=True, kw_only=True)
class Balance:
    """Whether motor and tension of a recording agree by the model's mechanism.

    Rows begin when a change of tension has told which way friction points.
    """

    name: str
    """Of the recording."""
    time: Array
    """Since the recording's first row [s], shape (T,)."""
    angle: Array
    """Of the motor [rad], shape (T,)."""
    offset: Array
    """Angle of the motor beyond what its tension leaves it [rad], shape (T,)."""
    slope: Array
    """Tension per angle of the motor [N/rad], shape (T,)."""
    radius: float
    """Of the spool [m]; one on a shaft."""
    follows: Array
    """What a model's error on a mechanism follows: the tension, and which way frictions point,
    shape (T, P)."""

    def less(self, usual: Array) -> Balance:
        """Return it without the model's usual error, which follows what it follows, shape (P,)."""
        return replace(self, offset=self.offset - self.follows @ usual)


@dataclass(frozen=True, kw_only=True)
class CalmDay:
    """Recordings in which nothing happened: what a model leaves there is no event."""

    balances: tuple[Balance, ...]
    """Those that are long enough to hold a step; none where they are too few."""
    usual: Array
    """Model's usual error there, shape (P,)."""
    step: float
    """Greatest rise of the offset there [rad]."""
    pulse: float
    """Greatest pulse of the offset there [rad]."""
    missing: float | None
    """Greatest share of the supply that was missing there [1]; None where no voltage was logged."""


def calm_day(recordings: Sequence[Recording], model: Model) -> CalmDay:
    """Measure what a model leaves of recordings in which nothing happened.

    Args:
        recordings: All of one bench.
        model: Model of the bench.
    """
    fallen = [missing_supply(r)[0].max() for r in recordings if r.voltage is not None]
    missing = max(LEAST_DIP, *map(float, fallen)) if fallen else None
    found = balances(with_cell(recordings), model)
    calm = tuple(own for own in found if own.time[-1] - own.time[0] > 2.0 * SIDE)
    if len(calm) < LEAST_CALM:
        return CalmDay(balances=(), usual=np.zeros(0), step=0.0, pulse=0.0, missing=missing)
    unseen = [own.less(usual_error([other for other in calm if other is not own])) for own in calm]
    return CalmDay(
        balances=calm,
        usual=usual_error(calm),
        step=max(float(np.abs(steps(own)).max()) for own in unseen),
        pulse=max(float(np.abs(pulses(own)).max()) for own in unseen),
        missing=missing,
    )


def find_events(calm: CalmDay, recordings: Sequence[Recording], model: Model) -> tuple[Event, ...]:
    """Find what happened within recordings.

    Args:
        calm: The bench where nothing happened.
        recordings: Recordings to look at.
        model: Model of the bench in them.

    Returns:
        Slips, skips and knocks by recording, then dips. Without a load cell there are dips alone,
        without a voltage all others.
    """
    found = balances(with_cell(recordings), model) if calm.balances else []
    return (*(event for own in found for event in events_of(own, calm)), *dips(calm, recordings))


def with_cell(recordings: Sequence[Recording]) -> list[Recording]:
    """Return the recordings that have a load cell and a command."""
    return [r for r in recordings if r.force is not None and r.driven_by == "command"]


def balances(recordings: Sequence[Recording], model: Model) -> list[Balance]:
    """Let the measured tensions drive a model's mechanism."""
    if not recordings:
        return []
    causes = tuple(effect.cause for effect in model.effects)
    driven = [replace(recording, command=None) for recording in recordings]
    study = Study(driven, model, causes, time_step=SEARCH_STEP)
    stated = spool_radius_of(model)
    tendons = {r.bench: bench_of(r.bench, model).tendons for r in driven}
    residuals = study.residuals(*replacements([{}]))
    out = list[Balance]()
    for own, (_, d), residual in zip(study.recordings, study.sources, residuals, strict=True):
        assert own.force is not None
        force, angle = own.force[:, 0], own.motor_position[:, 0]
        offset = residual.theta[0]
        path = np.polynomial.Polynomial.fit(angle - offset, force, 3)
        size = force / WIDTHS[-1]
        columns = [np.ones_like(force), size, size**2, size**3, size**4]
        for width in WIDTHS:
            way = turned(force, width)
            columns += [way, way * size, way * size**2]
        told = np.flatnonzero(np.abs(turned(force, WIDTHS[-1])) >= 1.0)
        rows = slice(int(told[0]), None) if len(told) else slice(0, 0)
        if len(offset[rows]) > 1:
            out.append(
                Balance(
                    name=own.name,
                    time=(own.time - own.time[0])[rows],
                    angle=angle[rows],
                    offset=offset[rows],
                    slope=path.deriv()(angle - offset)[rows],
                    radius=stated or tendons[own.bench][d].spool_radius,
                    follows=np.stack(columns, axis=1)[rows],
                )
            )
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


def around(own: Balance, length: float) -> Iterator[tuple[int, int, int]]:
    """Return each row with the first and the end of those within a time [s] of it."""
    time = own.time
    firsts = np.searchsorted(time, time - length)
    ends = np.searchsorted(time, time + length, side="right")
    return zip(range(len(time)), firsts.tolist(), ends.tolist(), strict=True)


def steps(own: Balance) -> Array:
    """Return how far the offset rises at each row [rad], shape (T,); none near the ends."""
    out = np.zeros_like(own.offset)
    for k, first, end in around(own, SIDE):
        if own.time[0] + SIDE <= own.time[k] <= own.time[-1] - SIDE:
            out[k] = np.median(own.offset[k:end]) - np.median(own.offset[first:k])
    return out


def pulses(own: Balance) -> Array:
    """Return how far the offset stands out of a while around each row [rad], shape (T,)."""
    middle = [np.median(own.offset[first:end]) for _, first, end in around(own, PULSE)]
    return own.offset - np.array(middle)


def events_of(own: Balance, calm: CalmDay) -> list[Event]:
    """Return what stands out of a recording's balance, in the order of time."""
    left = own.less(calm.usual)
    rises = steps(left)
    k, at = int(np.argmax(np.abs(rises))), None
    events = list[Event]()
    if abs(rises[k]) > MARGIN * calm.step:
        at = start_of_step(left, k)
        size = size_of_step(own, calm.balances, at)
        jump = np.ptp(own.angle[max(0, at - JUMP) : at + JUMP + 1])
        skips = size < 0.0 or jump > 0.5 * size
        events.append(
            Event(
                recording=own.name,
                kind="skip" if skips else "slip",
                start=float(own.time[at]),
                end=None,
                size=size if skips else size * own.radius,
                unit="rad" if skips else "m",
                above=float(abs(rises[k]) / calm.step),
            )
        )
        left = replace(left, offset=left.offset - size * (np.arange(len(left.offset)) >= at))
    out = pulses(left)
    if at is not None:
        out[np.abs(own.time - own.time[at]) < CALM] = 0.0
    k = int(np.argmax(np.abs(out)))
    if abs(out[k]) > PULSE_MARGIN * calm.pulse:
        share = out / out[k]
        start, end = stretch(share >= ONSET, k)
        force = (own.slope * out)[start:end][share[start:end] >= PLATEAU]
        events.append(
            Event(
                recording=own.name,
                kind="knock",
                start=float(own.time[start]),
                end=float(own.time[end - 1]),
                size=float(np.median(force)),
                unit="N",
                above=float(abs(out[k]) / calm.pulse),
            )
        )
    return sorted(events, key=lambda event: event.start)


def start_of_step(own: Balance, near: int) -> int:
    """Return the first row of a step: that from which the offset is halfway from before."""
    first, end = np.searchsorted(own.time, own.time[near] + np.array((-SIDE, SIDE)))
    part = own.offset[first:end]
    count = np.arange(1, len(part))
    sums = np.cumsum(part)[:-1]
    means, rest = sums / count, (part.sum() - sums) / (len(part) - count)
    between = count * (len(part) - count) * (rest - means) ** 2
    at = int(np.argmax(between))
    away = np.abs(part - means[at]) > 0.5 * abs(rest[at] - means[at])
    begin = max(0, int(np.searchsorted(own.time[first:end], own.time[first + at] - CALM)))
    return int(first) + begin + int(np.argmax(away[begin:]))


def size_of_step(own: Balance, calm: Sequence[Balance], at: int) -> float:
    """Return how far the offset rises for good at a row [rad], beside the model's usual error."""
    nothing = [np.zeros((len(other.offset), 2)) for other in calm]
    after = np.arange(len(own.offset)) >= at
    levels = (*nothing, np.column_stack([np.ones(len(after)), after]))
    with_levels = [
        replace(other, follows=np.column_stack([other.follows, level]))
        for other, level in zip((*calm, own), levels, strict=True)
    ]
    return float(usual_error(with_levels)[-1])


def dips(calm: CalmDay, recordings: Sequence[Recording]) -> list[Event]:
    """Find where the supply fell further than where nothing happened."""
    events = list[Event]()
    for recording in recordings:
        if recording.voltage is None or calm.missing is None:
            continue
        share, time = missing_supply(recording)
        k = int(np.argmax(share))
        if share[k] > MARGIN * calm.missing:
            start, end = stretch(share > MARGIN * calm.missing, k)
            events.append(
                Event(
                    recording=recording.name,
                    kind="dip",
                    start=float(time[start]),
                    end=float(time[end - 1]),
                    size=float(np.median(share[start:end])),
                    unit="1",
                    above=float(share[k] / calm.missing),
                )
            )
    return events


def missing_supply(recording: Recording) -> tuple[Array, Array]:
    """Return the share of the supply that is missing [1], and the time [s], shape (T,) each."""
    assert recording.voltage is not None
    time = recording.time - recording.time[0]
    return 1.0 - recording.voltage / np.median(recording.voltage), time


def stretch(there: Mask, inside: int) -> tuple[int, int]:
    """Return the first row and the end of a stretch of rows around one of them."""
    away = np.flatnonzero(~there)
    place = int(np.searchsorted(away, inside))
    first = int(away[place - 1]) + 1 if place else 0
    return first, int(away[place]) if place < len(away) else len(there)
