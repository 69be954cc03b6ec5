"""Recordings cut in time, so that one long log gives something to fit and something to test."""

import itertools
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tendon_newton.data.channels import CHANNELS
from tendon_newton.data.recording import Recording
from tendon_newton.errors import InvalidDataset
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.simulation.tendons.measured_force import has_spring

LEAST_DURATION = 2.0  # Time without which a part says nothing [s]
ROW_FIELDS = ("time", *(channel.field for channel in CHANNELS), "enabled")
"""Fields of a recording with one entry per row."""
SEGMENT = 0.25
"""Length of a segment [s]: in it a force wrong by a tenth of the weight moves the load by 30 mm."""
SLOPE = 0.02
"""Time either side of a segment's start whose slope gives its first speed [s]: a register lags."""
SLOPE_ROWS = 3  # Fewest rows of a slope
LEAST_ROWS = 8  # Rows without which a segment says nothing


def rows_of(recording: Recording, span: slice, name: str) -> Recording:
    """Return some rows of a recording under another name; it starts where it was measured."""
    rows = {
        field: values[span]
        for field in ROW_FIELDS
        if (values := getattr(recording, field)) is not None
    }
    return replace(
        recording,
        name=name,
        extra={key: values[span] for key, values in recording.extra.items()},
        start="first_row" if span.start else recording.start,
        **rows,
    )


def beginning(recording: Recording, seconds: float) -> Recording:
    """Return the rows of a recording up to some time after its first [s]."""
    row = int(np.searchsorted(recording.time, recording.time[0] + seconds))
    return rows_of(recording, slice(0, row), recording.name)


def first_part(recordings: Sequence[Recording], seconds: float) -> list[Recording]:
    """Return the beginnings of recordings, in their order, that take some time [s] together."""
    taken: list[Recording] = []
    for recording in recordings:
        left = seconds - sum(part.duration for part in taken)
        if taken and left < LEAST_DURATION:
            break
        taken.append(beginning(recording, left) if left < recording.duration else recording)
    return taken


def hold_out(
    recordings: Sequence[Recording], share: float
) -> tuple[tuple[Recording, ...], tuple[Recording, ...]]:
    """Return what may be fitted and what only reports: the end of every recording is held out.

    The two parts of a recording share a bench and a day, but no row and no window.

    Args:
        recordings: Recordings none of which is held out as a whole.
        share: Share of each that is held out [1].

    Raises:
        InvalidDataset: A part would be shorter than `LEAST_DURATION`.
    """
    train, test = [], []
    for recording in recordings:
        row = int(
            np.searchsorted(recording.time - recording.time[0], (1.0 - share) * recording.duration)
        )
        parts = [
            rows_of(recording, slice(0, row), recording.name),
            rows_of(recording, slice(row, recording.sample_count), f"{recording.name} (end)"),
        ]
        if min(part.duration for part in parts) < LEAST_DURATION:
            raise InvalidDataset(
                f"{recording.name}: a recording that is cut must give two parts of "
                f"{LEAST_DURATION:g} s or more; it lasts {recording.duration:.1f} s and "
                f"{share:g} of it would be held out"
            )
        train.append(parts[0])
        test.append(parts[1])
    return tuple(train), tuple(test)


def segments(mechanism: Mechanism, recording: Recording) -> list[Recording]:
    """Return a recording in segments where its mechanism only integrates, else as it is.

    Without commands and without springs a constant error of force grows with the square of time,
    and soon nothing else is seen. A fit compares short segments instead.
    """
    if recording.driven_by != "force" or has_spring(mechanism, recording.bench_overrides):
        return [recording]
    count = max(1, round(recording.duration / SEGMENT))
    edges = np.linspace(recording.time[0], recording.time[-1], count + 1)[1:-1]
    places = [0, *np.searchsorted(recording.time, edges).tolist(), recording.sample_count]
    spans = [slice(a, b) for a, b in itertools.pairwise(places) if b - a >= LEAST_ROWS]
    return [segment(recording, span) for span in spans] or [recording]


def segment(recording: Recording, span: slice) -> Recording:
    """Return some rows of a recording, to be simulated from their first."""
    start = span.start
    reach = max(SLOPE_ROWS, round(SLOPE * (recording.sample_count - 1) / recording.duration))
    near = slice(max(0, start - reach), start + reach + 1)
    since = recording.time[near] - recording.time[start]
    angle = recording.motor_position[near]
    fit = np.polynomial.polynomial.polyfit(since, angle, 2)
    part = rows_of(recording, span, recording.name)
    velocity = np.concatenate([fit[1:2], part.motor_velocity[1:]])
    return replace(part, motor_velocity=velocity, start="first_row")


def all_segments(
    mechanisms: Sequence[Mechanism], recordings: Sequence[Recording]
) -> list[Recording]:
    """Return the segments of recordings, one mechanism for each."""
    pairs = zip(mechanisms, recordings, strict=True)
    return [part for mechanism, recording in pairs for part in segments(mechanism, recording)]
