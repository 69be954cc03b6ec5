"""Gradients of a rollout: every reading by every number that went in, in float64."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
import warp as wp

from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Array, Indices, Recording
from tendon_newton.effects import Stage
from tendon_newton.errors import SimulationDiverged
from tendon_newton.gradients.gradient_assembly import copied_components, gradient_kernel_set
from tendon_newton.gradients.substep_chain import SubstepChain, launch
from tendon_newton.gradients.substep_plan import distinct_plans
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.simulation.hosts.rollout import TIME_STEP, Rollout
from tendon_newton.simulation.hosts.timeline import Timeline
from tendon_newton.simulation.model.parameter_table import ParameterTable, spool_radius_of
from tendon_newton.simulation.model.structure import Structure
from tendon_newton.simulation.model.supported_effects import refuse_stages

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
"""Arrays of the mechanism that carry gradients."""
ROUTE_NUMBERS = ("path_point", "path_radius")
"""Those of routed tendons; the zero of their excursion stays where it is."""
CONTACT_NUMBERS = (
    "obstacle_position",
    "obstacle_size",
    "obstacle_stiffness",
    "obstacle_dissipation",
    "obstacle_friction",
    "capsule_radius",
)
"""Those of contacts."""


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

    joint_position: Any
    """[rad] or [m], shape (S, J)."""
    motor_position: Any
    """What the encoder reports [rad], shape (S, D)."""
    motor_velocity: Any
    """Its rate [rad/s], shape (S, D)."""
    force: Any
    """Tension at the load cell [N], shape (S, D)."""


READINGS = tuple(field.name for field in fields(Readings))


class DifferentiableRollout:
    """One world per recording, simulated as by `Rollout`, with gradients.

    ``forward()`` fills `readings`; ``backward(force=..., motor_position=...)`` takes the
    derivatives of a loss by the readings and fills the gradients of `inputs`. Numbers in `inputs`
    may be assigned between runs; their arrays stay where they are. The start counts: a run that
    starts in equilibrium carries the derivative of the equilibrium.

    Args:
        mechanism: The bench.
        recordings: R recordings of it.
        model: Actuator and effects with their numbers.
        effects: Further effects at null, whose gradients are wanted.
        time_step: Longest step [s].
        segments: In how many parts the run is walked back. Only one part's states are kept at a
            time, and all but the last are simulated again: a long run needs less memory.
        inline: Whether the substep is compiled as one piece: half a minute longer, and then a
            third faster backwards.
        at_once: Whether `backward` takes many substeps at once; by default on a GPU with room.
        device: Warp device.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        recordings: Sequence[Recording],
        model: Model,
        *,
        effects: Sequence[str] = (),
        time_step: float = TIME_STEP,
        segments: int = 1,
        inline: bool = False,
        at_once: bool | None = None,
        device: Any = None,
    ) -> None:
        every = (*effects, *(e.name for e in model.effects if e.name not in effects))
        refuse_stages(every, (Stage.CELL_CLOCK, Stage.CELL_LAG), "DifferentiableRollout")
        rollout = self._make_rollout(
            mechanism,
            recordings,
            actuator=model.actuator.name,
            effects=every,
            spool_radius=spool_radius_of(model),
            time_step=time_step,
            device=device,
        )
        self._rollout = rollout
        self.table: ParameterTable = rollout.table
        self.timelines: tuple[Timeline, ...] = rollout.timelines
        self.recordings: tuple[Recording, ...] = rollout.recordings
        self._device = rollout.device
        self._worlds = len(self.timelines)
        self._kernel_of, self._types = gradient_kernel_set(rollout.kernels.structure, inline)
        vectors = rollout.array(rollout.base_vectors(model), self._types["ParameterVector"])
        self.inputs = make_inputs(rollout, vectors)
        self._settled = self._settle()
        self._schedule, self._row_substep = self._make_schedule(time_step)
        length = math.ceil(len(self._schedule.time) / segments)
        self._segments = self._make_segments(length)
        self._states = [
            self._zeros((length + 1, self._worlds), name)
            for name in ("JointVector", "JointVector", "MemoryVector")
        ]
        for state in self._states:
            state.retain_grad = True  # a walk reads the adjoints once more
        self._starts = [
            wp.zeros((len(self._segments), self._worlds), dtype=state.dtype, device=self._device)
            for state in self._states
        ]
        rows = sum(len(timeline.time) for timeline in self.timelines)
        self.readings = Readings(
            joint_position=self._zeros(rows, "JointVector"),
            motor_position=self._zeros(rows, "TendonVector"),
            motor_velocity=self._zeros(rows, "TendonVector"),
            force=self._zeros(rows, "TendonVector"),
        )
        self.substeps = SubstepChain(
            rollout.kernels.structure,
            self._kernel_of,
            self._types,
            [*self._common(), self._schedule],
            self._states,
            segments=len(self._segments),
            at_once=at_once,
        )
        """The way from the first state to the last, and back."""
        self._at_end = False
        """Whether the states are those of the last segment."""
        self.graphs: dict[str, Any] = {}
        """Captured runs by name, from the second `forward` and `backward` on."""
        self.run_count = 0
        """How often `forward` has run: its states are those of the last time."""

    def _make_rollout(
        self, mechanism: Mechanism, recordings: Sequence[Recording], **options: Any
    ) -> Rollout:
        return Rollout(mechanism, recordings, **options)

    @property
    def bench_names(self) -> tuple[str, ...]:
        """Names of the mechanism's arrays in `inputs` that carry gradients."""
        return bench_names(self._rollout.kernels.structure)

    def rows_of(self, recording: int) -> slice:
        """Return where a recording's rows stand among all."""
        return self._rollout.rows_of(recording)

    def forward(self) -> Readings:
        """Simulate.

        Raises:
            SimulationDiverged: A state is not finite.
        """
        self.run_count += 1
        self._at_end = True
        self._settle()
        self._run("forward", self._simulate)
        self._make_room()
        if not np.isfinite(self.readings.joint_position.numpy()).all():
            raise SimulationDiverged("the simulation must stay finite; shorten its step")
        return self.readings

    def backward(self, **seeds: Array) -> Inputs:
        """Walk the last `forward` back.

        Args:
            **seeds: Derivatives of a loss by the readings of the given names, in their shapes.
        """
        if not self._at_end:
            self._run("to the end", lambda: self._return_to(len(self._segments) - 1))
        self._at_end = len(self._segments) == 1
        self._zero_gradients()
        for name, seed in seeds.items():
            getattr(self.readings, name).grad.assign(seed)
        self._run("backward", self._walk_back)
        return self.inputs

    def gradient(self, owner: str, parameter: str) -> Array:
        """Return the last gradient by one number of an actuator or effect, shape (W,)."""
        return self.inputs.parameters.grad.numpy()[:, self.table.column(owner, parameter)]

    def _run(self, name: str, work: Callable[[], None]) -> None:
        """Run a chain of launches.

        The first time one by one, the second time recording, from then on as one graph.
        """
        if name not in self.graphs:
            with copied_components():
                work()
            self.graphs[name] = None
            return
        if self.graphs[name] is None:
            with wp.ScopedCapture(device=self._device) as capture:
                work()
            self.graphs[name] = capture.graph
        wp.capture_launch(self.graphs[name])

    def _make_room(self) -> None:
        """Make room for what the last run has left; what was captured may have to be anew."""
        if self.substeps.make_room():
            for name in [name for name in self.graphs if name.startswith("back")]:
                del self.graphs[name]

    def _simulate(self) -> None:
        """Launch the start, all substeps, and the readings of all rows."""
        self.substeps.counts.zero_()
        self._launch_start()
        for index, segment in enumerate(self._segments):
            if index > 0:
                self._copy_row(self._states, -1, self._states, 0)
            self._copy_row(self._states, 0, self._starts, index)
            self.substeps.forward(0, segment.length, index)
            self._launch_reading(segment)

    def _walk_back(self) -> None:
        """Launch the adjoints of the same, the last first."""
        last = len(self._segments) - 1
        for index in range(last, -1, -1):
            segment = self._segments[index]
            if index < last:
                self._return_to(index)
            self._launch_reading(segment, back=True)
            self.substeps.begin_backward(segment.length, index)
            self.substeps.backward(0, segment.length, index)
            self.substeps.end_backward(index)
        self._launch_start(back=True)

    def _return_to(self, index: int) -> None:
        """Simulate a segment again; the adjoint of its end is that of the next one's start."""
        self._copy_row(self._starts, index, self._states, 0)
        gradients = [state.grad for state in self._states]
        self._copy_row(gradients, 0, gradients, -1)
        for gradient in gradients:
            gradient[:-1].zero_()
        self.substeps.forward(0, self._segments[index].length, index)

    def _copy_row(self, source: list[Any], of: int, target: list[Any], to: int) -> None:
        """Copy a row of the states of all worlds; negative ones count from the end."""
        arguments = [of % len(source[0]), to % len(target[0]), *source, *target]
        self._launch(self._kernel_of["copy"], self._worlds, arguments)

    def _zero_gradients(self) -> None:
        """Forget what earlier walks left."""
        for array in self._gradient_owners():
            array.grad.zero_()

    def _gradient_owners(self) -> Iterator[Any]:
        """Yield all arrays that have a gradient."""
        yield from (self.inputs.parameters, self.inputs.command)
        yield from (getattr(self.inputs.mechanism, name) for name in self.bench_names)
        yield from self._states
        yield from (getattr(self.readings, name) for name in READINGS)

    def _common(self) -> list[Any]:
        """Return what every kernel reads first."""
        return [self.inputs.mechanism, self.inputs.parameters, self._rollout.commands]

    def _launch_start(self, *, back: bool = False) -> None:
        arguments = [*self._common(), self._settled, self._memory, *self._states]
        self._launch(self._kernel_of["start"], self._worlds, arguments, back=back)

    def _launch_reading(self, segment: Segment, *, back: bool = False) -> None:
        outputs = [getattr(self.readings, name) for name in READINGS]
        arguments = [*self._common(), *segment.rows, *self._states, *outputs]
        self._launch(self._kernel_of["reading"], len(segment.rows[0]), arguments, back=back)

    def _launch(
        self, kernel: wp.Kernel, count: int, arguments: list[Any], *, back: bool = False
    ) -> None:
        adjoints = [None] * len(arguments) if back else None
        launch(kernel, count, arguments, self._device, adjoints)

    def _settle(self) -> Any:
        """Find where each recording starts; the start kernel adds the derivative."""
        if not hasattr(self, "_settled"):
            self._settled = wp.zeros(
                self._worlds, dtype=self._types["JointVector"], device=self._device
            )
            self._speed = wp.zeros_like(self._settled)
            self._memory = wp.zeros(
                self._worlds, dtype=self._types["MemoryVector"], device=self._device
            )
        worlds = wp.array(np.arange(self._worlds, dtype=np.int32), device=self._device)
        rollout = self._rollout
        arguments = [
            0,
            self.inputs.mechanism,
            worlds,
            worlds,
            self.inputs.parameters,
            rollout.commands,
            self._settled,
            self._speed,
            self._memory,
        ]
        wp.launch(rollout.kernels.settle, self._worlds, inputs=arguments, device=self._device)
        return self._settled

    def _make_schedule(self, time_step: float) -> tuple[Any, Array]:
        """Lay out every world's substeps, and find the substep at which each row begins."""
        plans, index = distinct_plans(self.timelines, time_step)
        shape = (max(len(time) for time, _, _ in plans), len(plans))
        columns: dict[str, Any] = {"time": np.zeros(shape), "duration": np.zeros(shape)}
        columns["row"] = np.zeros(shape, dtype=np.int32)
        for column, plan in enumerate(plans):
            for name, values in zip(columns, plan, strict=True):
                columns[name][: len(values), column] = values
        starts = [
            np.append(np.flatnonzero(np.diff(row, prepend=-1)), len(row)) for _, _, row in plans
        ]
        return self._schedule_of(columns, index), np.concatenate([starts[k] for k in index])

    def _schedule_of(self, columns: dict[str, Array], index: Indices) -> Any:
        """Return the struct of a schedule: columns by name, and each world's column."""
        schedule = self._types["Schedule"]()
        for name, values in {**columns, "plan": index.astype(np.int32)}.items():
            whole = np.issubdtype(values.dtype, np.integer)
            dtype = wp.int32 if whole else self._types["real"]
            setattr(schedule, name, self._rollout.array(values, dtype))
        return schedule

    def _make_segments(self, length: int) -> list[Segment]:
        """Divide the run into parts of so many substeps, and give each its rows."""
        substeps = len(self._schedule.time)
        world = np.repeat(np.arange(self._worlds), [len(t.time) for t in self.timelines])
        owner = np.minimum(self._row_substep, substeps - 1) // length
        parts = []
        for index, first in enumerate(range(0, substeps, length)):
            rows = np.flatnonzero(owner == index)
            # neighbouring threads are of different worlds, whose gradients do not collide
            rows = rows[np.argsort(self._row_substep[rows], kind="stable")]
            columns = (rows, world[rows], self._row_substep[rows] - first)
            parts.append(
                Segment(
                    length=min(length, substeps - first),
                    rows=[self._rollout.array(c.astype(np.int32), wp.int32) for c in columns],
                )
            )
        return parts

    def _zeros(self, shape: Any, name: str) -> Any:
        return wp.zeros(shape, dtype=self._types[name], device=self._device, requires_grad=True)


@dataclass(frozen=True, kw_only=True)
class Segment:
    """A part of a run."""

    length: int
    """Number of substeps."""
    rows: list[Any]
    """The rows that are read in it, their worlds, and their states, shape (N,) each."""


def bench_names(structure: Structure) -> tuple[str, ...]:
    """Return the names of a mechanism's arrays that carry gradients."""
    routed = ROUTE_NUMBERS if structure.routes.spans else ()
    touching = CONTACT_NUMBERS if structure.touch.contacts else ()
    return (*DIFFERENTIABLE_NUMBERS, *routed, *touching)


def make_inputs(rollout: Rollout, vectors: Any) -> Inputs:
    """Give all that a rollout reads a gradient."""
    vectors.requires_grad = True
    bench = bench_names(rollout.kernels.structure)
    for struct, names in ((rollout.numbers, bench), (rollout.commands, ("angle",))):
        for name in names:
            array = getattr(struct, name)
            array.requires_grad = True
            setattr(struct, name, array)  # the struct holds the address of the gradient too
    return Inputs(parameters=vectors, command=rollout.commands.angle, mechanism=rollout.numbers)
