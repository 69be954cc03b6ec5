"""The course of a run with a force network inside: torch and Warp take turns, there and back."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
import warp as wp
from torch import Tensor, nn

from tendon_newton.actuators.networks.torchscript import TorchScriptQuery
from tendon_newton.data.recording import Array, Indices
from tendon_newton.device_code.placeholders import TendonVector, Vec3
from tendon_newton.device_code.structs import Query
from tendon_newton.gradients.substep_plan import SubstepPlan
from tendon_newton.gradients.taped_run import TapedRun
from tendon_newton.simulation.hosts.network_source import NetworkSource, balance
from tendon_newton.simulation.hosts.query_rows import NONE_LEFT
from tendon_newton.simulation.hosts.torch_bridge import plain_tensor
from tendon_newton.simulation.model.kernel_arrays import struct_of

EXACT_STEPS = 30  # Steps of the search for the starting force in float64


@dataclass(frozen=True, kw_only=True)
class TapedNetwork:
    """A force network through which gradients pass."""

    module: nn.Module
    """Maps windows (N, H, 3), oldest sample first, to forces [N], (N,) or (N, 1). It is used as it
    is: in the precision of its weights, float64 for exact gradients."""
    window: int
    """Samples H in a window."""
    rate: float
    """Samples per second [Hz]."""

    def source(self) -> NetworkSource:
        """Return it as a rollout takes it."""
        query = TorchScriptQuery(self.module, window=self.window, rate=self.rate, limit=np.inf)
        return NetworkSource(query)

    def course(self, run: TapedRun, queries: Indices, plan: SubstepPlan) -> NetworkCourse:
        """Return the course of a run that asks it in these rows; see `NetworkCourse`."""
        return NetworkCourse(run, self, queries, plan)


class NetworkCourse:
    """A run forwards and backwards whose forces come from a network.

    A run that starts in equilibrium carries the derivative of the balance between network and
    mechanism.

    `queries` has the row of each query of each recording, `NONE_LEFT` at its end, shape (Q, W).
    """

    def __init__(
        self, run: TapedRun, network: TapedNetwork, queries: Indices, plan: SubstepPlan
    ) -> None:
        self._run, self._network, self._slots = run, network.module, plan.slots
        # What the network has learned, in the order of `weight_gradients`
        self.weights: tuple[nn.Parameter, ...] = tuple(network.module.parameters())
        self.weight_gradients: tuple[Tensor, ...] = ()
        structure = run.rollout.kernels.structure
        self._tendons, self._held_memory = structure.tendon_count, structure.held_memory
        last = np.array([len(t.time) - 1 for t in run.rollout.timelines], dtype=np.int32)
        rows = np.where(queries == NONE_LEFT, last, queries).astype(np.int32)
        self._rows = run.rollout.array(rows, wp.int32)
        self._samples = run.array((len(queries), run.world_count * self._tendons), Vec3)
        self._force = run.array((len(queries), run.world_count), TendonVector)
        self._seen, self._told = plain_tensor(self._samples), plain_tensor(self._force)
        k = torch.arange(len(queries))[:, None] + torch.arange(1 - network.window, 1)
        # Samples in the window of each query, shape (Q, H)
        self._places = k.clamp(min=0).to(self._seen.device)

    def forward(self) -> None:
        """Simulate."""
        run = self._run
        self._balance()
        run.substeps.counts.zero_()
        run.record("start", run.start)
        for query in range(len(self._places)):
            run.record(f"sense {query}", lambda query=query: self._sense(query))
            with torch.no_grad():
                self._told[query] = self._answer(self._window_of(query)).view_as(self._told[query])
            run.record(f"part {query}", lambda query=query: self._part(query))
        run.record("reading", lambda: run.read(*run.segments))

    def backward(self, seeds: dict[str, Array]) -> None:
        """Walk back, from derivatives of a loss by the readings."""
        run = self._run
        slopes = self._balance_slopes()
        self._seed(seeds)
        weights = [torch.zeros_like(weight) for weight in self.weights]
        run.record("back from reading", lambda: run.read(*run.segments, back=True))
        run.record("back begins", lambda: run.substeps.begin_backward(run.segments[0].length))
        seen, told = plain_tensor(self._samples.grad), plain_tensor(self._force.grad)
        for query in reversed(range(len(self._places))):
            run.record(f"back from part {query}", lambda query=query: self._part_back(query))
            self._pull_back(query, self._window_of(query), told[query], seen, weights)
            self._sense_back(query)
        run.record("back ends", run.substeps.end_backward)
        self._start_back()
        self._pull_back_balance(slopes, seen, weights)
        self.weight_gradients = tuple(weights)

    def _seed(self, seeds: dict[str, Array]) -> None:
        """Forget what earlier walks left, and write derivatives by the readings."""
        self._samples.grad.zero_()
        self._force.grad.zero_()
        self._run.seed(seeds)

    def _window_of(self, query: int) -> Tensor:
        """Return what the network sees in a query, shape (N, H, 3)."""
        return self._seen[self._places[query]].transpose(0, 1)

    def _answer(self, window: Tensor) -> Tensor:
        """Return the network's forces [N], shape (N,), in the precision of the simulation."""
        return self._network(window.to(self.weights[0].dtype)).reshape(-1).to(window.dtype)

    def _pull_back(
        self, query: int, window: Tensor, seed: Tensor, seen: Tensor, weights: list[Tensor]
    ) -> None:
        """Add the derivatives by weights and samples that a seed by the forces has."""
        with torch.enable_grad():
            leaf = window.detach().requires_grad_()
            found = torch.autograd.grad(
                self._answer(leaf), (leaf, *self.weights), seed.reshape(-1), allow_unused=True
            )
        seen.index_add_(0, self._places[query], found[0].transpose(0, 1))
        for total, part in zip(weights, found[1:], strict=True):
            if part is not None:
                total += part

    def _held(self, memory: Any) -> Tensor:
        """Return the held forces in a memory of all worlds, shape (W, D)."""
        return plain_tensor(memory)[:, self._held_memory : self._held_memory + self._tendons]

    def _balance(self) -> None:
        """Find the forces at which network and mechanism are in balance, and settle there."""
        force = self._held(self._run.settled.memory)
        limit, least = (
            plain_tensor(getattr(self._run.inputs.mechanism, name)).reshape(force.shape)
            for name in ("force_limit", "least_tension")
        )

        def answer(trial: Tensor) -> Tensor:
            self._settle_under(force, trial)
            with torch.no_grad():
                return self._answer(self._window_of(0)).view_as(trial)

        self._settle_under(force, balance(answer, least, limit, EXACT_STEPS))

    def _settle_under(self, held: Tensor, force: Tensor) -> None:
        """Put the worlds at rest under forces [N], and show the network what they do there."""
        held.copy_(force)
        self._run.settle()
        self._run.record("start", self._run.start)
        self._run.record("sense 0", lambda: self._sense(0))

    def _balance_slopes(self) -> Tensor:
        """Return how the network's answer to a balance follows its force, shape (W, D, D)."""
        rows = []
        seen = plain_tensor(self._samples.grad)
        unused = [torch.zeros_like(weight) for weight in self.weights]
        for tendon in range(self._tendons):
            self._seed({})
            seed = torch.zeros_like(self._told[0])
            seed[:, tendon] = 1.0
            self._pull_back(0, self._window_of(0), seed, seen, unused)
            self._sense_back(0)
            self._start_back()
            rows.append(self._held(self._run.settled.memory.grad).clone())
        return torch.stack(rows, dim=1)

    def _pull_back_balance(self, slopes: Tensor, seen: Tensor, weights: list[Tensor]) -> None:
        """Add what the balance adds: F = f(F) moves by df / (1 - f') (implicit function)."""
        run = self._run
        left = torch.eye(self._tendons).to(slopes) - slopes.transpose(1, 2)
        seed = torch.linalg.solve(left, self._held(run.settled.memory.grad).clone())
        limit = plain_tensor(run.inputs.mechanism.force_limit).view_as(seed)
        inside = (self._told[0] > 0.0) & (self._told[0] < limit)
        for array in (self._samples, run.settled.memory, *run.state_arrays):
            array.grad.zero_()
        self._pull_back(0, self._window_of(0), torch.where(inside, seed, 0.0), seen, weights)
        self._sense_back(0)
        self._start_back()

    def _start_back(self) -> None:
        self._run.record("back from start", lambda: self._run.start(back=True))

    def _sense_back(self, query: int) -> None:
        self._run.record(f"back from sense {query}", lambda: self._sense(query, back=True))

    def _part_back(self, query: int) -> None:
        """Go back from the next query to this one's force."""
        self._run.substeps.backward(int(self._slots[query]) + 1, int(self._slots[query + 1]))
        self._hold(query, back=True)

    def _part(self, query: int) -> None:
        """Hold the forces of a query and go on to the next."""
        self._hold(query)
        self._run.substeps.forward(int(self._slots[query]) + 1, int(self._slots[query + 1]))

    def _sense(self, query: int, *, back: bool = False) -> None:
        arguments = [*self._run.common, self._query(query), self._run.states, self._samples]
        self._run.launch("sense", self._run.world_count, arguments, back=back)

    def _hold(self, query: int, *, back: bool = False) -> None:
        arguments = [*self._run.common, self._query(query), self._force, self._run.states]
        self._run.launch("hold", self._run.world_count, arguments, back=back)

    def _query(self, query: int) -> Any:
        """Return a query as kernels take it."""
        slot = int(self._slots[query])
        return struct_of(self._run.types, Query, index=query, slot=slot, row=self._rows)
