"""Gradients of a rollout with a force network inside: torch and Warp take turns, there and back."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cache
from typing import Any

import numpy as np
import torch
import warp as wp
from torch import Tensor, nn

from tendon_newton.actuators.networks.torchscript import TorchScriptQuery
from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Array, Indices, Recording
from tendon_newton.errors import InvalidParameter, SimulationDiverged
from tendon_newton.gradients import gradient_history_kernels
from tendon_newton.gradients.differentiable import (
    DifferentiableRollout,
    Inputs,
    Readings,
)
from tendon_newton.gradients.gradient_assembly import assemble_with_rules
from tendon_newton.gradients.substep_plan import substep_plan
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.simulation.hosts.balance import find_root
from tendon_newton.simulation.hosts.learned_rollout import NONE_LEFT, LearnedRollout
from tendon_newton.simulation.hosts.rollout import Rollout
from tendon_newton.simulation.hosts.torch_bridge import plain_tensor
from tendon_newton.simulation.model.kernel_types import kernel_types
from tendon_newton.simulation.model.structure import Structure

EXACT_STEPS = 30
"""Steps of the search for the starting force in float64."""


class DifferentiableLearnedRollout(DifferentiableRollout):
    """A `DifferentiableRollout` whose forces come from a network.

    `backward` gives the derivatives by the network's weights too, in `weight_gradients`. A run that
    starts in equilibrium carries the derivative of the balance between network and mechanism.

    Args:
        mechanism: The bench.
        recordings: R recordings of it.
        model: A model whose actuator is `learned`; its file is not read.
        network: Maps windows (N, H, 3), oldest sample first, to forces [N], (N,) or (N, 1). It is
            used as it is: in the precision of its weights, float64 for exact gradients.
        window: Samples H in a window.
        rate: Samples per second [Hz].
        **options: As for `DifferentiableRollout`.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        recordings: Sequence[Recording],
        model: Model,
        *,
        network: nn.Module,
        window: int,
        rate: float,
        **options: Any,
    ) -> None:
        self.network = network
        self.weights: tuple[nn.Parameter, ...] = tuple(network.parameters())
        """What the network has learned, in the order of `weight_gradients`."""
        self.weight_gradients: tuple[Tensor, ...] = ()
        self._window, self._rate = window, rate
        if options.get("segments", 1) != 1:
            raise InvalidParameter("a run with a network inside has one segment")
        super().__init__(mechanism, recordings, model, **options)
        structure = self._rollout.kernels.structure
        self._tendons = structure.tendon_count
        self._taped_kernel_of = learned_gradient_kernel_set(structure)
        self._memory.requires_grad = True
        self._make_queries()

    def _make_rollout(
        self, mechanism: Mechanism, recordings: Sequence[Recording], **options: Any
    ) -> Rollout:
        options.pop("actuator")
        query = TorchScriptQuery(self.network, window=self._window, rate=self._rate, limit=np.inf)
        return LearnedRollout(mechanism, recordings, query=query, **options)

    def _make_queries(self) -> None:
        """Allocate what goes between torch and Warp, one row per query."""
        table: Any = self._rollout.queries  # type: ignore[attr-defined]
        last = np.array([len(t.time) - 1 for t in self.timelines], dtype=np.int32)
        rows = np.where(table == NONE_LEFT, last, table).astype(np.int32)
        self._query_row = self._rollout.array(rows, wp.int32)
        servos = self._worlds * self._tendons
        self._samples = self._zeros((len(table), servos), "Vec3")
        self._force = self._zeros((len(table), self._worlds), "TendonVector")
        self._seen = plain_tensor(self._samples)
        self._told = plain_tensor(self._force)
        k = torch.arange(len(table))[:, None] + torch.arange(1 - self._window, 1)
        self._places = k.clamp(min=0).to(self._seen.device)
        """Samples in the window of each query, shape (Q, H)."""

    def _make_schedule(self, time_step: float) -> tuple[Any, Array]:
        """Lay out the substeps between queries, the same number for all worlds.

        The first slot of a query holds its force. A row begins behind it.
        """
        table: Any = self._rollout.queries  # type: ignore[attr-defined]
        plans = [substep_plan(timeline, time_step) for timeline in self.timelines]
        parts = [query_parts(plan[2], table[:, w]) for w, plan in enumerate(plans)]
        longest = [max(len(world[k]) for world in parts) for k in range(len(table))]
        self._slots = np.concatenate([[0], np.cumsum(np.array(longest) + 1)])
        shape = (int(self._slots[-1]), self._worlds)
        time, duration = np.zeros(shape), np.zeros(shape)
        row = np.zeros(shape, dtype=np.int32)
        starts = []
        for world, (plan, own) in enumerate(zip(plans, parts, strict=True)):
            slot_of = np.empty(len(plan[2]), dtype=int)
            for k, substeps in enumerate(own):
                slots = self._slots[k] + 1 + np.arange(len(substeps))
                slot_of[substeps] = slots
                for target, values in zip((time, duration, row), plan, strict=True):
                    target[slots, world] = values[substeps]
            begins = np.flatnonzero(np.diff(plan[2], prepend=-1))
            starts.append(
                np.append(
                    slot_of[begins],
                    last_slot(
                        self._slots, table[:, world], slot_of, len(self.timelines[world].time)
                    ),
                )
            )
        columns = {"time": time, "duration": duration, "row": row}
        return self._schedule_of(columns, np.arange(self._worlds)), np.concatenate(starts)

    def forward(self) -> Readings:
        """Simulate.

        Raises:
            SimulationDiverged: A state is not finite.
        """
        self.run_count += 1
        self._balance()
        self.substeps.counts.zero_()
        self._run("start", self._launch_start)
        for query in range(len(self._places)):
            self._run(f"sense {query}", lambda query=query: self._launch_sense(query))
            with torch.no_grad():
                self._told[query] = self._answer(self._window_of(query)).view_as(self._told[query])
            self._run(f"part {query}", lambda query=query: self._launch_part(query))
        self._run("reading", lambda: self._launch_reading(*self._segments))
        self._make_room()
        if not np.isfinite(self.readings.joint_position.numpy()).all():
            raise SimulationDiverged("the simulation must stay finite; shorten its step")
        return self.readings

    def backward(self, **seeds: Array) -> Inputs:
        """Walk the last `forward` back.

        Args:
            **seeds: Derivatives of a loss by the readings of the given names, in their shapes.
        """
        slopes = self._balance_slopes()
        self._zero_gradients()
        weights = [torch.zeros_like(weight) for weight in self.weights]
        for name, seed in seeds.items():
            getattr(self.readings, name).grad.assign(seed)
        self._run("back from reading", lambda: self._launch_reading(*self._segments, back=True))
        self._run("back begins", lambda: self.substeps.begin_backward(self._segments[0].length))
        seen, told = plain_tensor(self._samples.grad), plain_tensor(self._force.grad)
        for query in reversed(range(len(self._places))):
            self._run(f"back from part {query}", lambda query=query: self._walk_part_back(query))
            self._pull_back(query, self._window_of(query), told[query], seen, weights)
            self._walk_sense_back(query)
        self._run("back ends", self.substeps.end_backward)
        self._walk_start_back()
        self._pull_back_balance(slopes, seen, weights)
        self.weight_gradients = tuple(weights)
        return self.inputs

    def _window_of(self, query: int) -> Tensor:
        """Return what the network sees in a query, shape (N, H, 3)."""
        return self._seen[self._places[query]].transpose(0, 1)

    def _answer(self, window: Tensor) -> Tensor:
        """Return the network's forces [N], shape (N,), in the precision of the simulation."""
        return self.network(window.to(self.weights[0].dtype)).reshape(-1).to(window.dtype)

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
        first = self._rollout.kernels.structure.held_memory
        return plain_tensor(memory)[:, first : first + self._tendons]

    def _balance(self) -> None:
        """Find the forces at which network and mechanism are in balance, and settle there."""
        force = self._held(self._memory)
        limit, least = (
            plain_tensor(getattr(self.inputs.mechanism, name)).reshape(force.shape)
            for name in ("force_limit", "least_tension")
        )
        least = torch.maximum(least, -limit)

        def excess(trial: Tensor) -> Tensor:
            """Return what the network gives beyond a force that holds the mechanism."""
            force.copy_(trial)
            self._settle()
            self._run("start", self._launch_start)
            self._run("sense 0", lambda: self._launch_sense(0))
            with torch.no_grad():
                return self._answer(self._window_of(0)).view_as(trial).clamp(least, limit) - trial

        excess(find_root(excess, least, limit, EXACT_STEPS))

    def _balance_slopes(self) -> Tensor:
        """Return how the network's answer to a balance follows its force, shape (W, D, D)."""
        rows = []
        seen = plain_tensor(self._samples.grad)
        unused = [torch.zeros_like(weight) for weight in self.weights]
        for tendon in range(self._tendons):
            self._zero_gradients()
            seed = torch.zeros_like(self._told[0])
            seed[:, tendon] = 1.0
            self._pull_back(0, self._window_of(0), seed, seen, unused)
            self._walk_sense_back(0)
            self._walk_start_back()
            rows.append(self._held(self._memory.grad).clone())
        return torch.stack(rows, dim=1)

    def _pull_back_balance(self, slopes: Tensor, seen: Tensor, weights: list[Tensor]) -> None:
        """Add what the balance adds: F = f(F) moves by df / (1 - f') (implicit function)."""
        left = torch.eye(self._tendons).to(slopes) - slopes.transpose(1, 2)
        seed = torch.linalg.solve(left, self._held(self._memory.grad).clone())
        limit = plain_tensor(self.inputs.mechanism.force_limit).view_as(seed)
        inside = (self._told[0] > 0.0) & (self._told[0] < limit)
        arrays: list[Any] = [self._samples, self._memory, *self._states]
        for array in arrays:
            array.grad.zero_()
        self._pull_back(0, self._window_of(0), torch.where(inside, seed, 0.0), seen, weights)
        self._walk_sense_back(0)
        self._walk_start_back()

    def _walk_start_back(self) -> None:
        self._run("back from start", lambda: self._launch_start(back=True))

    def _walk_sense_back(self, query: int) -> None:
        self._run(f"back from sense {query}", lambda: self._launch_sense(query, back=True))

    def _walk_part_back(self, query: int) -> None:
        self.substeps.backward(int(self._slots[query]) + 1, int(self._slots[query + 1]))
        self._launch_hold(query, back=True)

    def _gradient_owners(self) -> Iterator[Any]:
        yield from super()._gradient_owners()
        yield from (self._memory, self._samples, self._force)

    def _launch_sense(self, query: int, *, back: bool = False) -> None:
        slot = int(self._slots[query])
        arguments = [slot, query, *self._common(), self._query_row, *self._states, self._samples]
        self._launch(self._taped_kernel_of["sense"], self._worlds, arguments, back=back)

    def _launch_hold(self, query: int, *, back: bool = False) -> None:
        slot = int(self._slots[query])
        arguments = [slot, query, *self._common(), self._query_row, self._force, *self._states]
        self._launch(self._taped_kernel_of["hold"], self._worlds, arguments, back=back)

    def _launch_part(self, query: int) -> None:
        """Hold the forces of a query and go on to the next."""
        self._launch_hold(query)
        self.substeps.forward(int(self._slots[query]) + 1, int(self._slots[query + 1]))


def query_parts(row: Array, queries: Indices) -> list[Indices]:
    """Return the substeps from each query of a recording to the next.

    Args:
        row: Row of each substep.
        queries: Row of each query, `NONE_LEFT` at the end.
    """
    edges = np.searchsorted(row, queries[queries != NONE_LEFT])
    edges = np.append(edges, np.full(len(queries) + 1 - len(edges), len(row)))
    return [np.arange(edges[k], edges[k + 1]) for k in range(len(queries))]


def last_slot(slots: Indices, queries: Indices, slot_of: Indices, rows: int) -> int:
    """Return the state in which a recording's last row is read: after its query or substep.

    Args:
        slots: First slot of each query.
        queries: Row of each query.
        slot_of: Slot of each substep.
        rows: Number of rows.
    """
    asked = np.flatnonzero(queries == rows - 1)
    return int(slots[asked[0]] if len(asked) else slot_of[-1]) + 1


@cache
def learned_gradient_kernel_set(structure: Structure) -> dict[str, wp.Kernel]:
    """Assemble the kernels between a tape and a network."""
    assembly = assemble_with_rules(structure, kernel_types(structure), inline=False)
    return {
        "sense": assembly.kernel(gradient_history_kernels.taped_sense_kernel, enable_backward=True),
        "hold": assembly.kernel(gradient_history_kernels.taped_hold_kernel, enable_backward=True),
    }
