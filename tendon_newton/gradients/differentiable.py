"""Gradients of a rollout: every reading by every number that went in, in float64."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Array, Recording
from tendon_newton.data.servo_names import effect_of
from tendon_newton.effects import Stage
from tendon_newton.errors import InvalidParameter, SimulationDiverged
from tendon_newton.gradients.adjoint import Adjoint
from tendon_newton.gradients.segmented_course import SegmentedCourse
from tendon_newton.gradients.substep_plan import query_plan, shared_plan
from tendon_newton.gradients.taped_run import Inputs, Readings, TapedRun
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.simulation.hosts.rollout import TIME_STEP, Rollout
from tendon_newton.simulation.model.parameter_table import ParameterTable, spool_radius_of
from tendon_newton.simulation.model.supported_effects import refuse_stages

if TYPE_CHECKING:
    from torch import Tensor, nn  # equations run without torch

    from tendon_newton.gradients.network_course import TapedNetwork

ONE_WALK = Adjoint()  # The whole run is walked back at once


class Course(Protocol):
    """The way of a run from its start to its end, and back."""

    weights: tuple[nn.Parameter, ...]  # What a network inside has learned
    weight_gradients: tuple[Tensor, ...]  # Derivatives of the last loss by it

    def forward(self) -> None:
        """Simulate."""
        ...

    def backward(self, seeds: dict[str, Array]) -> None:
        """Walk back, from derivatives of a loss by the readings."""
        ...


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
        effects: Further effects at null, whose gradients are wanted.
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
        effects: Sequence[str] = (),
        time_step: float = TIME_STEP,
        adjoint: Adjoint = ONE_WALK,
        device: Any = None,
    ) -> None:
        mechanism.refuse_moving_obstacle("DifferentiableRollout")
        every = (*effects, *(e.cause for e in model.effects if e.cause not in effects))
        refuse_stages(
            map(effect_of, every), (Stage.CELL_CLOCK, Stage.CELL_LAG), "DifferentiableRollout"
        )
        if network is not None and adjoint.segments != 1:
            raise InvalidParameter("a run with a network inside has one segment")
        self._rollout = Rollout(
            mechanism,
            recordings,
            actuator=model.actuator.name,
            effects=every,
            force=None if network is None else network.source(),
            spool_radius=spool_radius_of(model),
            time_step=time_step,
            device=device,
        )
        self.table: ParameterTable = self._rollout.table
        self.recordings: tuple[Recording, ...] = self._rollout.recordings
        timelines = self._rollout.timelines
        if network is None:
            self._run = TapedRun(self._rollout, model, shared_plan(timelines, time_step), adjoint)
            self._course: Course = SegmentedCourse(self._run)
        else:
            queries = self._rollout.force.rounds([timeline.time for timeline in timelines])
            plan = query_plan(timelines, queries, time_step)
            self._run = TapedRun(self._rollout, model, plan, adjoint)
            self._course = network.course(self._run, queries, plan)
        self.inputs: Inputs = self._run.inputs
        self.readings: Readings = self._run.readings
        self.substeps = self._run.substeps
        """The way from the first state to the last, and back."""
        self.graphs = self._run.graphs
        """Captured runs by name, from the second `forward` and `backward` on."""
        self.run_count = 0
        """How often `forward` has run: its states are those of the last time."""

    @property
    def bench_names(self) -> tuple[str, ...]:
        """Names of the mechanism's arrays in `inputs` that carry gradients."""
        return self._run.bench_names

    @property
    def weights(self) -> tuple[nn.Parameter, ...]:
        """What the network has learned."""
        return self._course.weights

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
