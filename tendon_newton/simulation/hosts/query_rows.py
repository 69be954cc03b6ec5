"""In which rows of a recording a force network is asked."""

from collections.abc import Sequence

import numpy as np

from tendon_newton.data.recording import Array, Indices
from tendon_newton.simulation.hosts.timeline import Timeline

NEAR = 0.1  # A row this near to the instant of a query, in periods of the network, stands for it
NONE_LEFT = -1  # Row of a recording that has ended


def with_queries(timeline: Timeline, rate: float) -> Timeline:
    """Return a timeline with a row at every instant of a network that is asked at a rate [Hz].

    Inserted rows hold the command that is in force.
    """
    time = timeline.time
    instants = query_instants(time, rate)
    distance = np.abs(time[nearest_rows(time, instants)] - instants)
    new = instants[distance > NEAR / rate]
    place = np.searchsorted(time, new)
    return Timeline(
        time=np.insert(time, place, new),
        command=np.insert(timeline.command, place, timeline.command[place - 1], axis=0),
        measured=timeline.measured + np.searchsorted(new, time[timeline.measured]),
        trusted=timeline.trusted,
    )


def query_instants(time: Array, rate: float) -> Array:
    """Return the instants [s] at which a network is asked from a first row to a last one."""
    return time[0] + np.arange(int((time[-1] - time[0]) * rate + NEAR) + 1) / rate


def nearest_rows(time: Array, instants: Array) -> Indices:
    """Return the row next to each instant."""
    after = np.clip(np.searchsorted(time, instants), 1, max(len(time) - 1, 1))
    before = after - 1
    after = np.minimum(after, len(time) - 1)
    return np.where(instants - time[before] <= time[after] - instants, before, after)


def query_table(times: Sequence[Array], rate: float) -> Indices:
    """Return the row of each query of each recording, `NONE_LEFT` at its end, shape (Q, R)."""
    columns = [nearest_rows(time, query_instants(time, rate)) for time in times]
    table = np.full((max(map(len, columns)), len(columns)), NONE_LEFT)
    for recording, rows in enumerate(columns):
        table[: len(rows), recording] = rows
    return np.asarray(table, dtype=np.int64)
