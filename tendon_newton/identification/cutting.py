"""Recordings cut in time, so that one long log gives something to fit and something to test."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tendon_newton.data.channels import CHANNELS
from tendon_newton.data.recording import Recording
from tendon_newton.errors import InvalidDataset

LEAST_DURATION = 2.0  # Time without which a part says nothing [s]
ROW_FIELDS = ("time", *(channel.field for channel in CHANNELS), "enabled")
"""Fields of a recording with one entry per row."""


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
