"""Recordings replayed in closed loop with a force network between command and tendon."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np
import torch
import warp as wp

from tendon_newton.actuators.networks.history import History
from tendon_newton.actuators.networks.query import with_hold
from tendon_newton.actuators.networks.torchscript import ForceQuery
from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Array, Indices, Recording
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.simulation.hosts.balance import find_root
from tendon_newton.simulation.hosts.rollout import Rollout
from tendon_newton.simulation.hosts.timeline import Timeline, make_timeline
from tendon_newton.simulation.kernels import history_kernels
from tendon_newton.simulation.model.assembly import assemble
from tendon_newton.simulation.model.kernel_types import kernel_types
from tendon_newton.simulation.model.structure import Structure

NEAR = 0.1
"""A row this near to the instant of a query, in periods of the network, stands for it."""
NONE_LEFT = -1
"""Row of a recording that has ended."""


class LearnedRollout(Rollout):
    """A `Rollout` whose forces come from a network, asked for all worlds at once.

    The network is asked at its own rate from a recording's first row on: in the row next to each
    instant, or in a row of its own where the log has none. Its history begins as if the first
    sample had always been there. What the log reads of the force in such a row is the new one.

    Args:
        mechanism: The bench that all recordings were made on.
        recordings: R recordings with commands.
        query: The network.
        **options: As for `Rollout`.
    """

    asks_network = True

    def __init__(
        self,
        mechanism: Mechanism,
        recordings: Sequence[Recording],
        *,
        query: ForceQuery,
        **options: Any,
    ) -> None:
        self.query = query
        super().__init__(mechanism, recordings, actuator="learned", **options)
        self._sense, self._hold = learned_kernel_set(self.kernels.structure)
        self.queries = query_table([t.time for t in self.timelines], query.rate)
        """Row of each query of each recording, `NONE_LEFT` at its end, shape (Q, R)."""

    def timeline_of(self, recording: Recording) -> Timeline:
        """Return the rows of a recording, with one wherever the network is asked."""
        return with_queries(make_timeline(recording), self.query.rate)

    def base_vectors(self, model: Model) -> Array:
        """Return a model's parameter vector for each recording, shape (R, P).

        How the force answers to the shaft, the network's card says where the model does not.
        """
        return super().base_vectors(with_hold(model, self.query.hold))

    def start(self, worlds: int, common: list[Any], state: list[Any]) -> None:
        """Put all worlds where their recordings start, in balance with what the network gives."""
        count = worlds * self.kernels.structure.tendon_count
        self.history = History(count, self.query.window, self.device)
        self._force = wp.zeros((worlds, count // worlds), dtype=wp.float32, device=self.device)
        force = wp.to_torch(self._force)
        servos = torch.ones(count, dtype=torch.bool, device=force.device)
        rows = self.array(self.queries[0].astype(np.int32), wp.int32)
        mechanism, world_mechanism = common[:2]
        bench = wp.to_torch(world_mechanism).long()
        limit, least = (
            wp.to_torch(getattr(mechanism, name)).reshape(-1, force.shape[1])[bench].float()
            for name in ("force_limit", "least_tension")
        )
        least = torch.maximum(least, -limit)

        def excess(trial: torch.Tensor) -> torch.Tensor:
            """Return what the network gives beyond a force that holds the mechanism."""
            force.copy_(trial)
            self.hold(common, state)
            super(LearnedRollout, self).start(worlds, common, state)
            self.query.forget(servos)
            self.sense(worlds, common, rows, state, fill=True)
            self.ask()
            return force.clamp(least, limit) - trial

        excess(find_root(excess, least, limit))
        self.query.forget(servos)

    def sense(
        self, worlds: int, common: list[Any], rows: Any, state: list[Any], *, fill: bool = False
    ) -> None:
        """Show the network all worlds in a row of each recording, shape (R,)."""
        arguments = [*common, rows, int(fill), *state, self.history.ring, self.history.newest]
        self._launch(self._sense, worlds, arguments)

    def ask(self) -> None:
        """Let the network say what all servos give."""
        self.query(self.history, self._force.flatten())

    def hold(self, common: list[Any], state: list[Any]) -> None:
        """Hold the forces that the network gave."""
        inputs = [*common[:2], self._force, state[2]]
        wp.launch(self._hold, len(self._force), inputs=inputs, device=self.device)

    def _simulate(
        self, worlds: int, common: list[Any], state: list[Any], outputs: list[Any], step: Any
    ) -> None:
        """Take all worlds from query to query."""
        self.start(worlds, common, state)
        count = len(self.recordings)
        begin, end = (wp.zeros(count, dtype=wp.int32, device=self.device) for _ in range(2))
        after = np.append(self.queries[1:], np.full_like(self.queries[:1], NONE_LEFT), axis=0)
        for rows, following in zip(self.queries, after, strict=True):
            begin.assign(rows)
            self.sense(worlds, common, begin, state)
            self.ask()
            self.hold(common, state)
            begin.assign(np.where(rows < 0, 1 << 30, rows))
            end.assign(np.where(following < 0, 1 << 30, following))
            self._launch(
                self.kernels.rollout, worlds, [*common, begin, end, step, *state, *outputs]
            )


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


@cache
def learned_kernel_set(structure: Structure) -> tuple[wp.Kernel, wp.Kernel]:
    """Return the kernels that show a network what a servo does and that hold what it answers."""
    assembly = assemble(structure, kernel_types(structure))
    return (
        assembly.kernel(history_kernels.sense_rows_kernel),
        assembly.kernel(history_kernels.hold_rows_kernel),
    )
