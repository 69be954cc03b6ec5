"""Events within recordings: a slip, a skip, a knock, a dip of the supply, with time and size.

An angle that skips jumps from row to row, and a slip or a knock jerks the tension though the
command stays. A slip leaves a step in the balance of motor and tension, and a knock a pulse. A dip
of the supply shows in the voltage, where it is logged.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from scipy.ndimage import convolve1d, median_filter

from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Array, Mask, Recording
from tendon_newton.diagnosis.in_time.balance import (
    JERK,
    PULSE,
    SIDE,
    Balance,
    balances,
    commanded,
    falls,
    pulses,
    pushed_offsets,
    rows_in,
    size_of_step,
    turns,
    usual_error,
    with_cell,
)

Kind = Literal["slip", "skip", "knock", "dip"]
MARGIN, PULSE_MARGIN, FALL_MARGIN = 1.5, 2.5, 4.0
"""How many times larger an event must be than anything on the day that the model knows [1]: a dip,
a pulse, and a fall of the tension. A finger that meets its end stop on another day only makes 3.8
times the falls; chosen on six virtual units, as the next ones are."""
LIVELIER = 2.0
"""How much more lively a command may be that makes no larger jumps and falls [1]: on a calm day few
steps are of one size."""
CALMEST = 0.1
"""Share of a calm day's rows, those of the calmest command, that are taken together [1]: a few rows
alone do not tell what is usual."""
LASTS = 5.0
"""How many times larger the step of a slip must be than a calm day's as a rule [1]: else what
jerked the tension was a knock. On six virtual units slips have 6 and more, and all
but one knock below 5."""
ONSET = 0.1  # Share of a pulse's peak from which it is there [1]
AROUND = 7  # Rows whose median pace is that of the angle
LEAST_JUMP = 4.0
"""How many times larger a skip must be than any jump on that day [1]: those are the encoder's."""
SETTLED = 0.05
"""Time after which a mechanism has followed a knock, and for which its force is read off [s]."""
EMPTY = 0.1  # Tension of a string that is empty [N]: some times the noise of a load cell
TRIED = np.linspace(0.0, 2.0, 9)
"""Forces of a knock that are tried, in how far the tension fell [1]: a string is stiffer than what
it pulls, so little of a force goes into anything else."""
LEAST_DIP = 0.03
"""Share of the supply that counts as missing on any day [1]: a register has tenths of a volt."""
LEAST_CALM = 2
"""Recordings without an event by which others are told, at least; each longer than twice `SIDE`."""


@dataclass(frozen=True, kw_only=True)
class Event:
    """Something that happened within a recording."""

    recording: str  # Its name, with the servo where there are several
    kind: Kind
    start: float  # Since the recording's first row [s]
    end: float | None  # The same of its end; None where it stays
    size: float
    """Slack that came [m], jump of the angle [rad], force along the tendon (positive where it
    closes the mechanism) [N], or share of the supply that was lost [1]."""
    unit: str
    above: float  # Size, in units of the greatest on the day that the model knows [1]
    at_least: bool = False
    """Whether it may be larger: more would have left the string as empty, the mechanism as far."""


@dataclass(frozen=True, kw_only=True)
class Usual:
    """Greatest size of something where nothing happened, by how the command's pace changes."""

    turns: Array  # Changes of the pace [rad], rising, shape (N,)
    most: Array  # Greatest size up to that change, shape (N,)

    def shares(self, sizes: Array, turns: Array) -> Array:
        """Return sizes in units of what is usual where the pace changes so [1], as the sizes."""
        most = np.interp(LIVELIER * turns, self.turns, self.most)
        return np.abs(sizes) / np.maximum(most, 1e-12)


@dataclass(frozen=True, kw_only=True)
class CalmDay:
    """Recordings in which nothing happened: what a model leaves there is no event."""

    balances: tuple[Balance, ...]
    """Those that are long enough to hold a step; none where they are too few."""
    usual: Array  # Model's usual error there, shape (P,)
    jump: Usual  # Jumps of the angle there [rad]
    fall: Usual  # Falls of the tension there [N]
    step: float  # Step of the offset that is found there, RMS [rad]
    pulse: float  # Greatest pulse of the offset there [rad]
    missing: float | None
    """Greatest share of the supply that was missing there [1]; None where no voltage was logged."""


def calm_day(recordings: Sequence[Recording], model: Model) -> CalmDay:
    """Measure what a model leaves of recordings in which nothing happened.

    Args:
        recordings: All of one bench.
    """
    fallen = [missing_supply(r)[0].max() for r in recordings if r.voltage is not None]
    missing = max(LEAST_DIP, *map(float, fallen)) if fallen else None
    driven = commanded(recordings)
    jump = usual([pair for r in driven for pair in jumps(r)] if len(driven) >= LEAST_CALM else [])
    found = balances(with_cell(recordings), model)
    calm = tuple(own for own in found if own.time[-1] - own.time[0] > 2.0 * SIDE)
    if len(calm) < LEAST_CALM:
        nothing, fall = np.zeros(0), usual([])
        return CalmDay(
            balances=(), usual=nothing, jump=jump, fall=fall, step=0.0, pulse=0.0, missing=missing
        )
    others = [[other for other in calm if other is not own] for own in calm]
    unseen = [own.less(usual_error(rest)) for own, rest in zip(calm, others, strict=True)]
    found = [
        size_of_step(own, rest, int(np.searchsorted(own.time, instant)))
        for own, rest in zip(calm, others, strict=True)
        for instant in np.arange(own.time[0] + SIDE, own.time[-1] - SIDE, PULSE)
    ]
    return CalmDay(
        balances=calm,
        usual=usual_error(calm),
        jump=jump,
        fall=usual([(falls(own), own.turns) for own in calm]),
        step=float(np.sqrt(np.mean(np.square(found)))),
        pulse=max(float(np.abs(pulses(own)).max()) for own in unseen),
        missing=missing,
    )


def usual(pairs: Sequence[tuple[Array, Array]]) -> Usual:
    """Return what is usual of sizes, each with its changes of the pace; without any, all is."""
    pairs = pairs or [(np.array([np.inf]), np.zeros(1))]
    sizes, changes = map(np.concatenate, zip(*pairs, strict=True))
    order = np.argsort(changes)
    most = np.maximum.accumulate(np.abs(sizes)[order])
    most[: int(CALMEST * len(most))] = most[int(CALMEST * len(most))]
    return Usual(turns=changes[order], most=most)


def find_events(calm: CalmDay, recordings: Sequence[Recording], model: Model) -> tuple[Event, ...]:
    """Find what happened within recordings.

    Returns:
        Slips, skips and knocks by recording, then dips. Without a load cell there are dips alone,
        without a voltage all others.
    """
    skipped = skips(calm, commanded(recordings))
    driven = [without(skipped, recording) for recording in with_cell(recordings)]
    found = balances(driven, model) if calm.balances else []
    events = [(event, own) for own in found for event in events_of(own, calm)]
    return (
        *(event for event, _ in skipped),
        *with_forces(events, driven, model),
        *dips(calm, recordings),
    )


def events_of(own: Balance, calm: CalmDay) -> list[Event]:
    """Return the first slip or knock of a recording, if there is one."""
    shares = calm.fall.shares(falls(own), own.turns)
    most = int(np.argmax(shares))
    if shares[most] > FALL_MARGIN:
        last = int(np.argmax((shares > FALL_MARGIN) & (own.time > own.time[most] - PULSE)))
        change = np.abs(np.diff(own.tension[last - JERK : last + 1]))
        at = last - JERK + 1 + int(np.argmax(change > ONSET * change.sum()))
        step, above = size_of_step(own, calm.balances, at), float(shares[most])
        return [slip(own, at, step, above) if step > LASTS * calm.step else knock(own, at, above)]
    out = pulses(own.less(calm.usual))
    peak = int(np.argmax(np.abs(out)))
    if abs(out[peak]) <= PULSE_MARGIN * calm.pulse:
        return []
    at, _ = stretch(out / out[peak] >= ONSET, peak)
    return [knock(own, at, float(abs(out[peak])) / calm.pulse)]


def slip(own: Balance, at: int, size: float, above: float) -> Event:
    """Return a string that slips at a row, by a size [rad]."""
    return Event(
        recording=own.name,
        kind="slip",
        start=float(own.time[at]),
        end=None,
        size=size * own.radius,
        unit="m",
        above=above,
    )


def knock(own: Balance, at: int, above: float) -> Event:
    """Return what pushed from a row on, until the tension goes back; as large as it fell."""
    settled = at + rows_in(own.time, SETTLED)
    reach = slice(settled, at + rows_in(own.time, PULSE))
    before = float(np.median(own.tension[max(0, at - JERK) : at + 1]))
    back = falls(own)[reach] * np.sign(own.tension[settled] - before)
    end = settled + int(np.argmax(back))
    return Event(
        recording=own.name,
        kind="knock",
        start=float(own.time[at]),
        end=float(own.time[end]),
        size=before - float(np.median(own.tension[settled : end + 1])),
        unit="N",
        above=above,
    )


def with_forces(
    events: Sequence[tuple[Event, Balance]], recordings: Sequence[Recording], model: Model
) -> list[Event]:
    """Return events whose knocks have the force that moves the model's mechanism as it moved."""
    knocks = [(event, own) for event, own in events if event.kind == "knock"]
    pushes = [TRIED[:, None] * fallen(event, own) for event, own in knocks]
    offsets = pushed_offsets([own.source for _, own in knocks], pushes, recordings, model)
    found = iter(offsets)
    return [
        pushing(event, own, next(found)) if event.kind == "knock" else event
        for event, own in events
    ]


def fallen(event: Event, own: Balance) -> Array:
    """Return a push as large as the tension fell, which sets in as it fell [N], shape (T,)."""
    at = int(np.searchsorted(own.time, event.start))
    settled = at + rows_in(own.time, SETTLED)
    share = (own.tension[max(0, at - 1)] - own.tension) / event.size
    share[settled:] = 1.0
    share[:at] = 0.0
    return event.size * np.maximum.accumulate(np.clip(share, 0.0, 1.0))


def pushing(event: Event, own: Balance, offsets: Array) -> Event:
    """Return a knock with its force, read off as soon as it has set in.

    With that force beside the measured tension the model's mechanism goes as far as motor and
    string went. What the model erred before the knock it errs then.

    Args:
        event: The knock, as large as the tension fell.
        own: The recording's balance.
        offsets: Offsets of the motor's angle under the forces that are tried [rad], shape (N, T).
    """
    assert event.end is not None
    at, end = np.searchsorted(own.time, [event.start, event.end])
    settled = rows_in(own.time, SETTLED)
    during = slice(at + settled, max(at + settled + 1, min(at + 2 * settled, end - 1)))
    before = offsets[:, max(0, at - JERK - 1) : max(1, at)].mean(axis=1)
    left = (np.median(offsets[:, during], axis=1) - before) * np.sign(event.size)
    if np.median(own.tension[during]) < EMPTY or not left[-1] <= 0.0 < left[0]:
        return replace(event, at_least=True)
    left = np.minimum.accumulate(left)
    return replace(event, size=float(np.interp(0.0, left[::-1], event.size * TRIED[::-1])))


def jumps(recording: Recording) -> list[tuple[Array, Array]]:
    """Return how far each angle jumps beside its pace, and the command's turns [rad], shape (T,).

    One row that is wrong, and right again in the next one, is no jump.
    """
    assert recording.command is not None
    change = np.diff(recording.motor_position, prepend=recording.motor_position[:1], axis=0)
    beside = convolve1d(change - median_filter(change, (AROUND, 1)), np.ones(3), axis=0)
    own = (turns(recording.time, command) for command in recording.command.T)
    return list(zip(np.asarray(beside, np.float64).T, own, strict=True))


def skips(calm: CalmDay, recordings: Sequence[Recording]) -> list[tuple[Event, int]]:
    """Find where angles jump further than where nothing happened, each with its servo."""
    events = list[tuple[Event, int]]()
    for recording in recordings:
        for servo, (jump, changes) in enumerate(jumps(recording)):
            shares = calm.jump.shares(jump, changes)
            at = int(np.argmax(shares))
            if shares[at] <= LEAST_JUMP:
                continue
            near = np.diff(recording.motor_position[at - 2 : at + 2, servo])
            first = at - 1 + int(np.argmax(np.abs(near)))
            event = Event(
                recording=recording.name,
                kind="skip",
                start=float(recording.time[first] - recording.time[0]),
                end=None,
                size=float(jump[at]),
                unit="rad",
                above=float(shares[at]),
            )
            events.append((event, servo))
    return events


def without(skipped: Sequence[tuple[Event, int]], recording: Recording) -> Recording:
    """Return a recording as it would be without its skip, to which the servo answers."""
    assert recording.command is not None
    step = np.zeros_like(recording.motor_position)
    for event, servo in skipped:
        if event.recording == recording.name:
            step[recording.time - recording.time[0] >= event.start, servo] = event.size
    return replace(
        recording, motor_position=recording.motor_position - step, command=recording.command - step
    )


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
