"""The course of a run whose forces are an equation: from start to end, segment by segment."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from tendon_newton.data.recording import Array
from tendon_newton.device_code.structs import StateRows
from tendon_newton.gradients.substep_chain import gradients_of
from tendon_newton.gradients.taped_run import TapedRun
from tendon_newton.simulation.model.kernel_arrays import zeros

if TYPE_CHECKING:
    from torch import Tensor, nn  # equations run without torch


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
