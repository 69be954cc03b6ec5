"""Into which substeps recordings are divided, and in which states their rows are read."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tendon_newton.data.recording import Array, Indices
from tendon_newton.simulation.hosts.query_rows import NONE_LEFT
from tendon_newton.simulation.hosts.timeline import Timeline

COLUMNS = ("time", "duration", "row")
# Instant [s], duration [s] and row of each substep of a recording
Substeps = tuple[Array, Array, Indices]


@dataclass(frozen=True, kw_only=True)
class SubstepPlan:
    """The substeps of W worlds in K slots; several worlds may share a column."""

    time: Array  # When each begins on the log's clock [s], shape (K, columns)
    duration: Array  # How long it is [s], 0 where nothing is simulated
    row: Indices  # Row of the recording to which it belongs
    column: Indices  # Column of each world, shape (W,)
    read_at: Indices  # State in which each row of all recordings is read, shape (S,)
    slots: Indices  # First slot of each query of a network, and the number of all, shape (Q + 1,)


def shared_plan(timelines: Sequence[Timeline], time_step: float) -> SubstepPlan:
    """Lay out every world's substeps one after the other; equal timelines share a column."""
    place: dict[bytes, int] = {}
    plans: list[Substeps] = []
    column = np.empty(len(timelines), dtype=int)
    for world, timeline in enumerate(timelines):
        key = timeline.time.tobytes()
        if key not in place:
            place[key] = len(plans)
            plans.append(substeps_of(timeline, time_step))
        column[world] = place[key]
    length = max(len(plan[0]) for plan in plans)
    slots = [np.arange(len(plan[0])) for plan in plans]
    starts = [np.append(first_of_rows(row), len(row)) for _, _, row in plans]
    return SubstepPlan(
        **laid_out(plans, slots, length),
        column=column,
        read_at=np.concatenate([starts[k] for k in column]),
        slots=np.array([0, length]),
    )


def query_plan(timelines: Sequence[Timeline], queries: Indices, time_step: float) -> SubstepPlan:
    """Lay out the substeps between queries (Q, W) of a network, the same number for all worlds.

    The first slot of a query holds its force. A row begins behind it.
    """
    plans = [substeps_of(timeline, time_step) for timeline in timelines]
    parts = [query_parts(plan[2], queries[:, w]) for w, plan in enumerate(plans)]
    longest = [max(len(world[k]) for world in parts) for k in range(len(queries))]
    first = np.concatenate([[0], np.cumsum(np.array(longest) + 1)])
    slots, read_at = [], []
    for world, (plan, own) in enumerate(zip(plans, parts, strict=True)):
        slot_of = np.empty(len(plan[2]), dtype=int)
        for k, substeps in enumerate(own):
            slot_of[substeps] = first[k] + 1 + np.arange(len(substeps))
        asked = np.flatnonzero(queries[:, world] == len(timelines[world].time) - 1)
        last = first[asked[0]] if len(asked) else slot_of[-1]  # of a query or a substep
        slots.append(slot_of)
        read_at.append(np.append(slot_of[first_of_rows(plan[2])], last + 1))
    return SubstepPlan(
        **laid_out(plans, slots, int(first[-1])),
        column=np.arange(len(timelines)),
        read_at=np.concatenate(read_at),
        slots=first,
    )


def substeps_of(timeline: Timeline, time_step: float) -> Substeps:
    """Return the substeps of a recording, divided as `rollout_kernel` does."""
    time = timeline.time - timeline.time[0]
    intervals = np.diff(time)
    counts = np.ceil(intervals / time_step - 1.0e-6).astype(int)
    row = np.repeat(np.arange(len(intervals)), counts)
    duration = (intervals / counts)[row]
    place = np.arange(len(row)) - np.repeat(np.cumsum(counts) - counts, counts)
    return time[row] + place * duration, duration, row


def first_of_rows(row: Indices) -> Indices:
    """Return the first substep of each row that has some."""
    return np.flatnonzero(np.diff(row, prepend=-1))


def laid_out(plans: list[Substeps], slots: list[Indices], length: int) -> dict[str, Any]:
    """Return the columns of plans whose substeps stand in slots, shape (length, plans) each."""
    shape = (length, len(plans))
    out = {name: np.zeros(shape) for name in COLUMNS}
    for column, (plan, own) in enumerate(zip(plans, slots, strict=True)):
        for name, values in zip(COLUMNS, plan, strict=True):
            out[name][own, column] = values
    return {**out, "row": out["row"].astype(np.int32)}


def query_parts(row: Indices, queries: Indices) -> list[Indices]:
    """Return the substeps from each query of a recording to the next.

    Queries are rows, `NONE_LEFT` at the end.
    """
    edges = np.searchsorted(row, queries[queries != NONE_LEFT])
    edges = np.append(edges, np.full(len(queries) + 1 - len(edges), len(row)))
    return [np.arange(edges[k], edges[k + 1]) for k in range(len(queries))]
