"""A chain of substeps, forwards and backwards: one after the other, or backwards all at once.

The adjoint of a state follows from that of the next one, lambda_k = J_k^T lambda_(k+1), and the
slopes J_k of a substep need no adjoint. That is used twice.

Substeps that an event has divided are few, and take three times the code of a whole one. So their
slopes are found at once, a walk only follows them, and what they add to the gradients of the inputs
comes at the end.

A GPU waits through most of a walk over few worlds: launch after launch of a few threads. So there
the slopes of all substeps are found, one launch per component of the state; a sweep takes the
adjoint back along them; and one launch more gives what they add up to. With n components that
is n + 1 times the arithmetic of a walk in a small part of its time, as long as the GPU has room.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp

from tendon_newton.simulation.model.structure import Structure

TOGETHER = 2**20
"""Substeps of all worlds whose slopes are found at once."""
ROOM = 20_000
"""Worlds times components of the state from which on one substep at a time is as fast: what an H200
has room for."""
GRADIENT_BLOCK = 64
"""Threads of a block on CUDA: few, so that a thousand worlds reach many multiprocessors."""


LEAST_ROOM = 1024
"""Slots for divided substeps to begin with."""


class SubstepChain:
    """The substeps of a differentiable rollout.

    Its states are those of one segment of the run, L substeps long: all of it, or a part.
    `forward` simulates; before `backward` come `make_room` and `begin_backward`, after it
    `end_backward`.

    Args:
        structure: What decides the kernels' code.
        kernels: Those of `substep_kernels`.
        types: The kernels' types.
        common: What each substep reads: the bench's numbers, the parameters, commands, schedule.
        states: Positions, velocities and memories with gradients, shape (L + 1, W) each.
        segments: How many there are.
        at_once: Whether `backward` takes many substeps at once; by default on a GPU with room.
    """

    def __init__(
        self,
        structure: Structure,
        kernels: dict[str, wp.Kernel],
        types: dict[str, Any],
        common: list[Any],
        states: list[Any],
        *,
        segments: int = 1,
        at_once: bool | None = None,
    ) -> None:
        self._kernels = kernels
        self._common, self._states = common, states
        self._length, self._worlds = states[0].shape[0] - 1, states[0].shape[1]
        self._device = states[0].device
        self._components = component_places(structure)
        if at_once is None:
            at_once = self._device.is_cuda and self._worlds * len(self._components) < ROOM
        self.at_once = at_once
        """Whether `backward` takes many substeps at once."""
        self._together = max(1, min(TOGETHER // self._worlds, self._length))
        shape = (self._length, self._worlds)
        self._divided = wp.zeros(shape, dtype=wp.int32, device=self._device)
        self._modes = wp.zeros(shape, dtype=types["Modes"], device=self._device)
        self.counts = wp.zeros(segments, dtype=wp.int32, device=self._device)
        """Divided substeps of each segment since this was set to zero, shape (segments,)."""
        self._listed = wp.zeros(1, dtype=wp.int32, device=self._device)
        self._make_list(LEAST_ROOM)
        self._seeds: list[Any] = []
        self._slopes: list[Any] = []

    def forward(self, first: int, end: int, segment: int = 0) -> None:
        """Simulate the substeps of a segment from `first` up to `end`, which is not one of them."""
        marks = [self._divided, self._modes, self.counts[segment : segment + 1]]
        for at in range(first, end):
            arguments = [self._substep(segment, at), at, *self._common, *marks, *self._states]
            self._launch("substep", self._worlds, arguments)

    def make_room(self) -> bool:
        """Make room for as many divided substeps as have been counted.

        Returns:
            Whether arrays have moved, so that what was captured of `backward` is of no use.
        """
        most = int(self.counts.numpy().max())
        if most <= self._places.shape[0]:
            return False
        self._make_list(1 << (most - 1).bit_length())
        return True

    def begin_backward(self, length: int, segment: int = 0) -> None:
        """Find the slopes of the substeps that an event has divided."""
        self._listed.zero_()
        self._launch("list", (length, self._worlds), [self._divided, self._listed, self._places])
        self._gather(0, self._states, self._listed_states)
        constant = [constant_copy(value) for value in self._common]
        states = [*map(constant_copy, self._listed_states), *self._listed_seeds]
        for component in range(len(self._components)):
            found = self._begin_component(component, self._listed_seeds, self._listed_slopes)
            self._divided_back(segment, constant, states, [*found, *self._listed_seeds])

    def backward(self, first: int, end: int, segment: int = 0) -> None:
        """Take the adjoint of state `end` back to state `first`, and add to the inputs' gradients.

        What the states between hold already, from the readings, comes on top.
        """
        if not self.at_once:
            states = [*self._states, *self._states]
            for at in reversed(range(first, end)):
                self._whole_back(segment, at, 1, (at, at + 1), self._common, states, follows=True)
            return
        for last in range(end, first, -self._together):
            start = max(first, last - self._together)
            self._find_slopes(segment, start, last - start)
            gradients = [state.grad for state in self._states]
            self._launch("sweep", self._worlds, [start, last - start, *self._slopes, *gradients])
            states = [*map(constant_copy, self._states), *self._states]
            rows = (start, start + 1)
            self._whole_back(segment, start, last - start, rows, self._common, states)

    def end_backward(self, segment: int = 0) -> None:
        """Add to the inputs' gradients what the divided substeps contribute."""
        self._gather(1, [state.grad for state in self._states], self._listed_seeds)
        states = [*map(constant_copy, self._listed_states), *self._listed_seeds]
        adjoints = [*[None] * len(self._states), *self._listed_seeds]
        self._divided_back(segment, self._common, states, adjoints)

    def _substep(self, segment: int, at: int) -> int:
        """Return which of all substeps is one of a segment."""
        return segment * self._length + at

    def _find_slopes(self, segment: int, start: int, count: int) -> None:
        """Write the derivatives of each substep's end by its beginning."""
        if not self._slopes:
            shape = (self._together, self._worlds)
            self._seeds = self._like_states(shape)
            self._slopes = self._like_states((len(self._components), *shape))
        constant = [constant_copy(value) for value in self._common]
        before = [constant_copy(state, start, count) for state in self._states]
        for component in range(len(self._components)):
            found = self._begin_component(component, self._seeds, self._slopes)
            states, adjoints = [*before, *self._seeds], [*found, *self._seeds]
            self._whole_back(segment, start, count, (0, 0), constant, states, adjoints)
        arguments = [start, self._listed, self._places, *self._listed_slopes, *self._slopes]
        self._launch("scatter", self._places.shape[0], arguments)

    def _begin_component(self, component: int, seeds: list[Any], slopes: list[Any]) -> list[Any]:
        """Seed one component of the states with one; return its slopes, all zero."""
        owner, place = self._components[component]
        for index, seed in enumerate(seeds):
            unit = np.zeros(seed.dtype._length_)
            if index == owner:
                unit[place] = 1.0
            seed.fill_(seed.dtype(*unit))
        found = [slope[component] for slope in slopes]
        for slope in found:
            slope.zero_()
        return found

    def _whole_back(
        self,
        segment: int,
        at: int,
        count: int,
        rows: tuple[int, int],
        common: list[Any],
        states: list[Any],
        adjoints: list[Any] | None = None,
        *,
        follows: bool = False,
    ) -> None:
        """Launch the adjoint of substeps that no event has divided."""
        inputs = [
            self._substep(segment, at),
            at,
            *rows,
            *common,
            self._divided,
            self._modes,
            int(follows),
            *self._listed_slopes,
        ]
        own = [None] * len(states) if adjoints is None else adjoints
        self._launch(
            "whole", (count, self._worlds), [*inputs, *states], [*[None] * len(inputs), *own]
        )

    def _divided_back(
        self, segment: int, common: list[Any], states: list[Any], adjoints: list[Any]
    ) -> None:
        """Launch the adjoint of those that one has."""
        inputs = [self._substep(segment, 0), *common, self._listed, self._places]
        self._launch(
            "divided", self._places.shape[0], [*inputs, *states], [*[None] * len(inputs), *adjoints]
        )

    def _gather(self, later: int, source: list[Any], target: list[Any]) -> None:
        arguments = [later, self._listed, self._places, *source, *target]
        self._launch("gather", self._places.shape[0], arguments)

    def _make_list(self, room: int) -> None:
        """Allocate the list of divided substeps, and what is kept of each."""
        self._places = wp.zeros(room, dtype=wp.int32, device=self._device)
        self._listed_states = self._like_states((room,))
        self._listed_seeds = self._like_states((room,))
        self._listed_slopes = self._like_states((len(self._components), room))

    def _like_states(self, shape: tuple[int, ...]) -> list[Any]:
        """Allocate one array for each of those of the states."""
        return [wp.zeros(shape, dtype=s.dtype, device=self._device) for s in self._states]

    def _launch(
        self, name: str, dim: Any, arguments: list[Any], adjoints: list[Any] | None = None
    ) -> None:
        launch(self._kernels[name], dim, arguments, self._device, adjoints)


def component_places(structure: Structure) -> list[tuple[int, int]]:
    """Return which array of the states holds each component of a state, and where in it."""
    joints, numbers = range(structure.coordinate_count), range(structure.memory_count)
    return [
        *((0, joint) for joint in joints),
        *((1, joint) for joint in joints),
        *((2, number) for number in numbers),
    ]


def launch(
    kernel: wp.Kernel,
    dim: Any,
    arguments: list[Any],
    device: Any,
    adjoints: list[Any] | None = None,
) -> None:
    """Launch a kernel that has a gradient, or its adjoint.

    Args:
        kernel: Made for blocks of `GRADIENT_BLOCK`.
        dim: Number of threads.
        arguments: What it takes.
        device: Warp device.
        adjoints: Gradient of each argument; None stands for the argument's own, if it has one.
    """
    own = (
        []
        if adjoints is None
        else [
            empty_struct(argument) if adjoint is None else adjoint
            for argument, adjoint in zip(arguments, adjoints, strict=True)
        ]
    )
    wp.launch(
        kernel,
        dim,
        inputs=arguments,
        adj_inputs=own,
        adjoint=adjoints is not None,
        device=device,
        block_dim=GRADIENT_BLOCK,
    )


def empty_struct(argument: Any) -> Any:
    """Return what stands in the place of a struct's gradients, None for anything else."""
    return argument._cls() if hasattr(argument, "_cls") else None


def constant_copy(value: Any, start: int = 0, count: int | None = None) -> Any:
    """Return an array's rows, or a struct of arrays, on the same memory and without gradients."""
    copy = empty_struct(value)
    if copy is not None:
        for name in value._cls.vars:
            setattr(copy, name, constant_copy(getattr(value, name)))
        return copy
    rows = value.shape[0] - start if count is None else count
    return wp.array(
        ptr=value.ptr + start * value.strides[0],
        shape=(rows, *value.shape[1:]),
        dtype=value.dtype,
        device=value.device,
    )
