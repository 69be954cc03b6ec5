"""What every way of differentiating a rollout shares: its arrays, its start and its readings."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
import warp as wp

from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Array
from tendon_newton.device_code.placeholders import ParameterVector
from tendon_newton.device_code.structs import Readout, ReadRows, Schedule, StateRows, States, Worlds
from tendon_newton.gradients.gradient_assembly import gradient_kernel_set
from tendon_newton.gradients.substep_chain import STATE, SubstepChain, launch
from tendon_newton.gradients.substep_plan import SubstepPlan
from tendon_newton.simulation.hosts.rollout import Rollout
from tendon_newton.simulation.model.kernel_arrays import struct_of, zeros
from tendon_newton.simulation.model.structure import Structure

# Arrays of the mechanism that carry gradients
DIFFERENTIABLE_NUMBERS = (
    "stiffness",
    "rest",
    "damping",
    "friction",
    "armature",
    "mass",
    "inertia",
    "centre",
    "offset",
    "arms",
    "spool_radius",
    "excursion_offset",
    "limit_stiffness",
    "limit_damping",
    "lower",
    "upper",
)
# Numbers of routed tendons; the zero of their excursion stays where it is
ROUTE_NUMBERS = ("path_point", "path_radius")
# Numbers of contacts
CONTACT_NUMBERS = (
    "obstacle_position",
    "obstacle_size",
    "obstacle_stiffness",
    "obstacle_dissipation",
    "obstacle_friction",
    "capsule_radius",
)


@dataclass(frozen=True, kw_only=True)
class Inputs:
    """What a rollout depends on; after `backward` each array has its gradient in `.grad`."""

    parameters: Any
    """Numbers of actuator and effects, shape (W, P); the rollout's `table` says where each
    stands."""
    command: Any
    """Commands [rad] of all rows, one recording after the other, shape (S, D)."""
    mechanism: Any
    """Struct with one array per number of the bench: ``stiffness`` (W, J), ``mass`` (W, J),
    ``arms`` (W, D, J), ..."""


@dataclass(frozen=True, kw_only=True)
class Readings:
    """What a rollout leads to, in all rows, one recording after the other."""

    joint_position: Any  # [rad] or [m], shape (S, J)
    motor_position: Any  # What the encoder reports [rad], shape (S, D)
    motor_velocity: Any  # Rate of the motor angle [rad/s], shape (S, D)
    force: Any  # Tension at the load cell [N], shape (S, D)


READINGS = tuple(field.name for field in fields(Readings))


@dataclass(frozen=True, kw_only=True)
class Segment:
    """A part of a run."""

    length: int  # Number of substeps
    rows: Any  # The rows that are read in it, a `ReadRows` struct


class TapedRun:
    """The arrays of a differentiable rollout, and the launches at both of its ends."""

    def __init__(self, rollout: Rollout, model: Model, plan: SubstepPlan, adjoint: Adjoint) -> None:
        structure = rollout.kernels.structure
        self.rollout, self.types, self.device = rollout, rollout.kernels.types, rollout.device
        self.world_count = len(rollout.timelines)
        self.kernels = gradient_kernel_set(structure)
        vectors = rollout.array(rollout.base_vectors(model), self.types[ParameterVector])
        # Names of the mechanism's arrays in `inputs` that carry gradients
        self.bench_names = bench_names(structure)
        self.inputs = make_inputs(rollout, vectors, self.bench_names)
        # What every kernel reads first
        self.common = [self.inputs.mechanism, self.inputs.parameters, rollout.commands]
        # Where each recording starts, before its derivative is added; memories have gradients
        self.settled = zeros(self.types, States, self.world_count, device=self.device)
        settled_memory = self.settled.memory
        settled_memory.requires_grad = True
        self.settled.memory = settled_memory
        length = math.ceil(len(plan.time) / adjoint.segments)
        self.segments = self._make_segments(plan, length)
        self.states = self._make_states(length + 1)
        rows = sum(len(timeline.time) for timeline in rollout.timelines)
        self._readout = zeros(self.types, Readout, rows, device=self.device, requires_grad=True)
        self.readings = Readings(**{name: getattr(self._readout, name) for name in READINGS})
        # The way from the first state to the last, and back
        self.substeps = SubstepChain(
            structure,
            self.kernels,
            self.types,
            [*self.common, self._schedule_of(plan)],
            self.states,
            segments=len(self.segments),
            at_once=adjoint.at_once,
        )
        self.graphs: dict[str, Any] = {}  # Captured runs by name, from the second run of each on

    @property
    def state_arrays(self) -> tuple[Any, ...]:
        """Arrays of the states: coordinates, rates and memories."""
        return tuple(getattr(self.states, name) for name in STATE)

    def record(self, name: str, work: Callable[[], None]) -> None:
        """Run a chain of launches.

        The first time one by one, the second time recording, from then on as one graph.
        """
        if name not in self.graphs:
            work()
            self.graphs[name] = None
            return
        if self.graphs[name] is None:
            with wp.ScopedCapture(device=self.device) as capture:
                work()
            self.graphs[name] = capture.graph
        wp.capture_launch(self.graphs[name])

    def make_room(self) -> None:
        """Make room for what the last run has left; what was captured may have to be anew."""
        if self.substeps.make_room():
            for name in [name for name in self.graphs if name.startswith("back")]:
                del self.graphs[name]

    def settle(self) -> None:
        """Find where each recording starts."""
        index = wp.array(np.arange(self.world_count, dtype=np.int32), device=self.device)
        parameters = self.inputs.parameters
        worlds = struct_of(
            self.types, Worlds, mechanism=index, recording=index, parameters=parameters
        )
        inputs = [0, self.inputs.mechanism, worlds, self.rollout.commands, self.settled]
        settle = self.rollout.kernels.settle
        wp.launch(settle, self.world_count, inputs=inputs, device=self.device)

    def start(self, *, back: bool = False) -> None:
        """Launch the start, which adds the derivative of where a recording starts."""
        arguments = [*self.common, self.settled, self.states]
        self.launch("start", self.world_count, arguments, back=back)

    def read(self, segment: Segment, *, back: bool = False) -> None:
        """Launch the readings of a segment."""
        arguments = [*self.common, segment.rows, self.states, self._readout]
        self.launch("reading", len(segment.rows.row), arguments, back=back)

    def launch(self, name: str, count: int, arguments: list[Any], *, back: bool = False) -> None:
        """Launch a kernel, or its adjoint."""
        launch(self.kernels[name], count, arguments, self.device, back=back)

    def seed(self, seeds: dict[str, Array]) -> None:
        """Forget what earlier walks left, and write derivatives of a loss by the readings."""
        arrays = [self.inputs.parameters, self.inputs.command, self.settled.memory]
        arrays += [getattr(self.inputs.mechanism, name) for name in self.bench_names]
        arrays += [*self.state_arrays, *(getattr(self.readings, name) for name in READINGS)]
        for array in arrays:
            array.grad.zero_()
        for name, seed in seeds.items():
            getattr(self.readings, name).grad.assign(seed)

    def array(self, count: Any, kind: Any) -> Any:
        """Return an array of zeros with a gradient."""
        return wp.zeros(count, dtype=self.types[kind], device=self.device, requires_grad=True)

    def _make_states(self, length: int) -> Any:
        """Allocate the states of a segment, whose adjoints a walk reads once more."""
        shape = (length, self.world_count)
        out = zeros(self.types, StateRows, *shape, device=self.device, requires_grad=True)
        for name in STATE:
            array = getattr(out, name)
            array.retain_grad = True
            setattr(out, name, array)  # the struct holds what an array says of its gradient
        return out

    def _schedule_of(self, plan: SubstepPlan) -> Any:
        """Return a plan as kernels take it."""
        real = self.rollout.array
        return struct_of(
            self.types,
            Schedule,
            time=real(plan.time, self.types[Schedule].vars["time"].type.dtype),
            duration=real(plan.duration, self.types[Schedule].vars["duration"].type.dtype),
            row=real(plan.row, wp.int32),
            plan=real(plan.column.astype(np.int32), wp.int32),
        )

    def _make_segments(self, plan: SubstepPlan, length: int) -> list[Segment]:
        """Divide the run into parts of so many substeps, and give each its rows."""
        substeps = len(plan.time)
        counts = [len(timeline.time) for timeline in self.rollout.timelines]
        world = np.repeat(np.arange(self.world_count), counts)
        owner = np.minimum(plan.read_at, substeps - 1) // length
        parts = []
        for index, first in enumerate(range(0, substeps, length)):
            rows = np.flatnonzero(owner == index)
            # neighbouring threads are of different worlds, whose gradients do not collide
            rows = rows[np.argsort(plan.read_at[rows], kind="stable")]
            columns = {"row": rows, "world": world[rows], "state": plan.read_at[rows] - first}
            arrays = {
                name: self.rollout.array(values.astype(np.int32), wp.int32)
                for name, values in columns.items()
            }
            read = struct_of(self.types, ReadRows, **arrays)
            parts.append(Segment(length=min(length, substeps - first), rows=read))
        return parts


def bench_names(structure: Structure) -> tuple[str, ...]:
    """Return the names of a mechanism's arrays that carry gradients."""
    routed = ROUTE_NUMBERS if structure.routes.spans else ()
    touching = CONTACT_NUMBERS if structure.touch.contacts else ()
    return (*DIFFERENTIABLE_NUMBERS, *routed, *touching)


def make_inputs(rollout: Rollout, vectors: Any, bench: tuple[str, ...]) -> Inputs:
    """Give all that a rollout reads a gradient."""
    vectors.requires_grad = True
    for struct, names in ((rollout.numbers, bench), (rollout.commands, ("angle",))):
        for name in names:
            array = getattr(struct, name)
            array.requires_grad = True
            setattr(struct, name, array)  # the struct holds the address of the gradient too
    return Inputs(parameters=vectors, command=rollout.commands.angle, mechanism=rollout.numbers)


@dataclass(frozen=True, kw_only=True)
class Adjoint:
    """How a `DifferentiableRollout` walks its run back."""

    segments: int = 1
    """In how many parts. Only one part's states are kept at a time, and all but the last are
    simulated again: a long run needs less memory."""
    at_once: bool | None = None
    """Whether many substeps are taken at once; None: on a GPU with room."""
