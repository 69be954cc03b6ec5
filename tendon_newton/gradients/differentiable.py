"""Gradients of a rollout: every reading by every number that went in, in float64."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Array, Recording
from tendon_newton.data.servo_names import effect_of
from tendon_newton.device_code.structs import StateRows
from tendon_newton.effects import Stage
from tendon_newton.errors import InvalidParameter, SimulationDiverged
from tendon_newton.gradients.substep_chain import gradients_of
from tendon_newton.gradients.substep_plan import query_plan, shared_plan
from tendon_newton.gradients.taped_run import Adjoint, Inputs, Readings, TapedRun
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.simulation.hosts.rollout import TIME_STEP, Rollout, Stepping
from tendon_newton.simulation.model.kernel_arrays import zeros
from tendon_newton.simulation.model.parameter_table import ParameterTable
from tendon_newton.simulation.model.stage_fields import refuse_stages

if TYPE_CHECKING:
    from torch import Tensor, nn  # equations run without torch

    from tendon_newton.gradients.network_course import NetworkCourse, TapedNetwork

ONE_WALK = Adjoint()  # The whole run is walked back at once


class DifferentiableRollout:
    """One world per recording, simulated as by `Rollout`, with gradients.

    ``forward()`` fills `readings`; ``backward(force=..., motor_position=...)`` takes the
    derivatives of a loss by the readings and fills the gradients of `inputs`, and of `weights`.
    Numbers in `inputs` may be assigned between runs; their arrays stay where they are. The start
    counts: a run that starts in equilibrium carries the derivative of the equilibrium.

    Args:
        mechanism: The bench.
        recordings: R recordings of it.
        model: Actuator and effects with their numbers. The file of a `learned` actuator is not
            read.
        network: The network of a `learned` actuator.
        time_step: Longest step [s].
        adjoint: How the run is walked back.
        device: Warp device.

    Raises:
        InvalidParameter: The actuator needs a network and none is given, or the run of a network
            is to be walked back in segments.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        recordings: Sequence[Recording],
        model: Model,
        *,
        network: TapedNetwork | None = None,
        time_step: float = TIME_STEP,
        adjoint: Adjoint = ONE_WALK,
        device: Any = None,
    ) -> None:
        mechanism.refuse_moving_obstacle("DifferentiableRollout")
        every = tuple(effect.cause for effect in model.effects)
        refuse_stages(
            map(effect_of, every), (Stage.CELL_CLOCK, Stage.CELL_LAG), "DifferentiableRollout"
        )
        if network is not None and adjoint.segments != 1:
            raise InvalidParameter("a run with a network inside has one segment")
        self._rollout = Rollout(
            mechanism,
            recordings,
            model,
            force=None if network is None else network.source(),
            stepping=Stepping(time_step=time_step, by_chain=False),
            device=device,
        )
        self.table: ParameterTable = self._rollout.table
        self.recordings: tuple[Recording, ...] = self._rollout.recordings
        timelines = self._rollout.timelines
        if network is None:
            self._run = TapedRun(self._rollout, model, shared_plan(timelines, time_step), adjoint)
            self._course: SegmentedCourse | NetworkCourse = SegmentedCourse(self._run)
        else:
            queries = self._rollout.force.rounds([timeline.time for timeline in timelines])
            plan = query_plan(timelines, queries, time_step)
            self._run = TapedRun(self._rollout, model, plan, adjoint)
            self._course = network.course(self._run, queries, plan)
        self.weights: tuple[nn.Parameter, ...] = self._course.weights
        """What the network has learned."""
        self.inputs: Inputs = self._run.inputs
        self.bench_names: tuple[str, ...] = self._run.bench_names
        """Names of the mechanism's arrays in `inputs` that carry gradients."""
        self.readings: Readings = self._run.readings
        self.substeps = self._run.substeps
        """The way from the first state to the last, and back."""
        self.graphs = self._run.graphs
        """Captured runs by name, from the second `forward` and `backward` on."""
        self.run_count = 0
        """How often `forward` has run: its states are those of the last time."""

    @property
    def weight_gradients(self) -> tuple[Tensor, ...]:
        """The last gradients by `weights`, in their order."""
        return self._course.weight_gradients

    def rows_of(self, recording: int) -> slice:
        """Return where a recording's rows stand among all."""
        return self._rollout.rows_of(recording)

    def forward(self) -> Readings:
        """Simulate.

        Raises:
            SimulationDiverged: A state is not finite.
        """
        self.run_count += 1
        self._course.forward()
        self._run.make_room()
        if not np.isfinite(self.readings.joint_position.numpy()).all():
            raise SimulationDiverged("the simulation must stay finite; shorten its step")
        return self.readings

    def backward(self, **seeds: Array) -> Inputs:
        """Walk the last `forward` back from derivatives of a loss by the named readings."""
        self._course.backward(seeds)
        return self.inputs

    def gradient(self, owner: str, parameter: str) -> Array:
        """Return the last gradient by one number of an actuator or a cause, shape (W,)."""
        return self.inputs.parameters.grad.numpy()[:, self.table.column(owner, parameter)]


class SegmentedCourse:
    """A run forwards and backwards; only one segment's states are kept at a time."""

    weights: tuple[nn.Parameter, ...] = ()
    weight_gradients: tuple[Tensor, ...] = ()

    def __init__(self, run: TapedRun) -> None:
        self._run = run
        self._starts = zeros(
            run.types, StateRows, len(run.segments), run.world_count, device=run.device
        )
        self._at_end = False  # Whether the states are those of the last segment

    def forward(self) -> None:
        """Simulate."""
        self._at_end = True
        self._run.settle()
        self._run.record("forward", self._simulate)

    def backward(self, seeds: dict[str, Array]) -> None:
        """Walk back, from derivatives of a loss by the readings."""
        last = len(self._run.segments) - 1
        if not self._at_end:
            self._run.record("to the end", lambda: self._return_to(last))
        self._at_end = last == 0
        self._run.seed(seeds)
        self._run.record("backward", self._walk_back)

    def _simulate(self) -> None:
        """Launch the start, all substeps, and the readings of all rows."""
        run = self._run
        run.substeps.counts.zero_()
        run.start()
        for index, segment in enumerate(run.segments):
            if index > 0:
                self._copy_row(run.states, -1, run.states, 0)
            self._copy_row(run.states, 0, self._starts, index)
            run.substeps.forward(0, segment.length, index)
            run.read(segment)

    def _walk_back(self) -> None:
        """Launch the adjoints of the same, the last first."""
        run = self._run
        last = len(run.segments) - 1
        for index in range(last, -1, -1):
            segment = run.segments[index]
            if index < last:
                self._return_to(index)
            run.read(segment, back=True)
            run.substeps.begin_backward(segment.length, index)
            run.substeps.backward(0, segment.length, index)
            run.substeps.end_backward(index)
        run.start(back=True)

    def _return_to(self, index: int) -> None:
        """Simulate a segment again; the adjoint of its end is that of the next one's start."""
        run = self._run
        self._copy_row(self._starts, index, run.states, 0)
        gradients = gradients_of(run.states)
        self._copy_row(gradients, 0, gradients, -1)
        for array in run.state_arrays:
            array.grad[:-1].zero_()
        run.substeps.forward(0, run.segments[index].length, index)

    def _copy_row(self, source: Any, of: int, target: Any, to: int) -> None:
        """Copy a row of the states of all worlds; negative ones count from the end."""
        arguments = [of % len(source.q), to % len(target.q), source, target]
        self._run.launch("copy", self._run.world_count, arguments)
