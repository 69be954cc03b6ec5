"""Recordings of a mechanism of several equal chains, replayed in the kernels of one of them."""

from __future__ import annotations

from typing import Any

import numpy as np

from tendon_newton.data.recording import Array
from tendon_newton.simulation.hosts.rollout import Rollout
from tendon_newton.simulation.model.chain_copies import chain_copies
from tendon_newton.simulation.model.mechanism_arrays import Topology, moment_arms


class ChainRollout(Rollout):
    """A `Rollout` whose kernels see each of K equal chains of a mechanism as one of its own.

    A hand then compiles in the time of a finger. In the kernels each recording is K worlds, chain
    by chain, each with its own tendons' commands; outside it is one, as ever. A mechanism of one
    chain, and one whose own numbers are unknown, stays whole.
    """

    chain_count = 1
    """Equal chains K of each world."""

    def run_rows(self, parameters: Array, time_step: float | None = None) -> dict[str, Array]:
        """Simulate as `Rollout.run_rows`, and set the chains of a recording side by side."""
        count = self.chain_count
        arrays = super().run_rows(np.repeat(parameters, count, axis=1), time_step)
        if count == 1:
            return arrays
        place = self._by_row(np.arange(sum(len(t.time) for t in self.timelines)))
        rows = np.argsort(place, kind="stable").reshape(-1, count)
        shape = (len(parameters), len(rows), -1)
        return {name: values[:, rows].reshape(shape) for name, values in arrays.items()}

    def _divided(self, model: Any, topology: Topology) -> Topology:
        if any(number.bench == self.recordings[0].bench for number in self._unknown):
            return topology
        copies = chain_copies(topology, moment_arms(model, topology))
        self.chain_count = copies.count
        return copies.topology

    def _by_world(self, values: Any) -> Any:
        count = self.chain_count
        if values.ndim == 1:
            return np.repeat(values, count)
        return values.reshape(len(values) * count, -1)

    def _by_row(self, values: Any) -> Any:
        count = self.chain_count
        edges = np.cumsum([len(timeline.time) for timeline in self.timelines])[:-1]
        laid = []
        for block in np.split(values, edges):
            laid += [block] * count if block.ndim == 1 else np.split(block, count, axis=1)
        return np.concatenate(laid)
