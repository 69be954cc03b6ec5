"""Segments of recordings whose mechanism forgets nothing, each starting where it was measured.

Without commands and without springs a mechanism only integrates: a constant error of force grows
with the square of time, and soon nothing else is seen. A fit compares short segments instead.
"""

import itertools
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tendon_newton.data.recording import Recording
from tendon_newton.identification.cutting import rows_of
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.simulation.tendons.measured_force import has_spring

SEGMENT = 0.25
"""Length of a segment [s]: in it a force wrong by a tenth of the weight moves the load by 30 mm."""
SLOPE = 0.02
"""Time either side of a segment's start whose slope gives its first speed [s]: a register lags."""
SLOPE_ROWS = 3  # Fewest rows of a slope
LEAST_ROWS = 8  # Rows without which a segment says nothing


def segments(mechanism: Mechanism, recording: Recording) -> list[Recording]:
    """Return a recording in segments where its mechanism only integrates, else as it is."""
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
