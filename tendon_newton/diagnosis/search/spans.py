"""The beginnings of recordings, on which sets of causes are chosen before all rows decide."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tendon_newton.data.recording import Recording
from tendon_newton.identification.cutting import rows_of

SPAN = 8.0
"""Length of a beginning [s]."""
MOST_SPANS = 10
"""Recordings of which a beginning is looked at."""


def beginnings(recordings: Sequence[Recording]) -> tuple[Recording, ...]:
    """Return the first seconds of recordings, spread evenly over a long list, benches in turn."""
    by_bench: dict[str, list[Recording]] = {}
    for recording in recordings:
        by_bench.setdefault(recording.bench, []).append(recording)
    share = max(1, MOST_SPANS // len(by_bench))
    chosen = []
    for own in by_bench.values():
        places = np.unique(np.linspace(0, len(own) - 1, min(len(own), share)).round().astype(int))
        chosen += [own[place] for place in places]
    if len(recordings) <= MOST_SPANS:
        chosen = list(recordings)
    return tuple(beginning(recording) for recording in chosen)


def beginning(recording: Recording) -> Recording:
    """Return a recording's first seconds."""
    row = int(np.searchsorted(recording.time - recording.time[0], SPAN))
    return rows_of(recording, slice(0, row), recording.name)
