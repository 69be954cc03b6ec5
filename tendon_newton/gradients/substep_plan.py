"""Into which substeps a recording is divided."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from tendon_newton.data.recording import Indices
from tendon_newton.simulation.hosts.timeline import Timeline


def distinct_plans(
    timelines: Sequence[Timeline], time_step: float
) -> tuple[list[tuple[Any, Any, Any]], Indices]:
    """Return the `substep_plan` of each different timeline, and which one each world has."""
    place: dict[bytes, int] = {}
    plans = []
    index = np.empty(len(timelines), dtype=int)
    for world, timeline in enumerate(timelines):
        key = timeline.time.tobytes()
        if key not in place:
            place[key] = len(plans)
            plans.append(substep_plan(timeline, time_step))
        index[world] = place[key]
    return plans, index


def substep_plan(timeline: Timeline, time_step: float) -> tuple[Any, Any, Any]:
    """Return instant [s], duration [s] and row of each substep of a recording.

    As `rollout_kernel` divides it.
    """
    time = timeline.time - timeline.time[0]
    intervals = np.diff(time)
    counts = np.ceil(intervals / time_step - 1.0e-6).astype(int)
    row = np.repeat(np.arange(len(intervals)), counts)
    duration = (intervals / counts)[row]
    place = np.arange(len(row)) - np.repeat(np.cumsum(counts) - counts, counts)
    return time[row] + place * duration, duration, row
