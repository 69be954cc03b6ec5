"""A chain of substeps, forwards and backwards: one after the other, or backwards all at once.

The adjoint of a state follows from that of the next one, lambda_k = J_k^T lambda_(k+1), and the
slopes J_k of a substep need no adjoint. A GPU waits through most of a walk over few worlds: launch
after launch of a few threads. So there the slopes of many substeps are found at once, one launch
per component of the state; a sweep takes the adjoint back along them; and one launch more gives
what all these substeps add to the gradients of the inputs. With n components that is n + 1 times
the arithmetic of a walk in a small part of its time, as long as the GPU has room.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp

from tendon_newton.simulation.structure import Structure

TOGETHER = 2**20
"""Substeps of all worlds whose slopes are found at once."""
ROOM = 20_000
"""Worlds times components of the state from which on one substep at a time is as fast: what an H200
has room for."""
GRADIENT_BLOCK = 64
"""Threads of a block on CUDA: few, so that a thousand worlds reach many multiprocessors."""


class SubstepChain:
    """The substeps of a differentiable rollout.

    Args:
        structure: What decides the kernels' code.
        kernels: ``substep`` and ``sweep``.
        types: The kernels' types.
        common: What each substep reads: the bench's numbers, the parameters, commands, schedule.
        states: Positions, velocities and memories with gradients, shape (K + 1, W) each.
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
        at_once: bool | None = None,
    ) -> None:
        self._kernels, self._types = kernels, types
        self._common, self._states = common, states
        self._worlds: int = states[0].shape[1]
        self._device = states[0].device
        self._components = component_places(structure)
        if at_once is None:
            at_once = self._device.is_cuda and self._worlds * len(self._components) < ROOM
        self.at_once = at_once
        """Whether `backward` takes many substeps at once."""
        self._together = max(1, min(TOGETHER // self._worlds, states[0].shape[0] - 1))
        self._slopes: list[Any] = []
        self._seeds: list[Any] = []

    def forward(self, first: int, end: int) -> None:
        """Simulate the substeps from `first` up to `end`, which is not one of them."""
        for substep in range(first, end):
            self._launch("substep", (1, self._worlds), self._arguments(substep))

    def backward(self, first: int, end: int) -> None:
        """Take the adjoint of state `end` back to state `first`, and add to the inputs' gradients.

        What the states between hold already, from the readings, comes on top.
        """
        if not self.at_once:
            for substep in reversed(range(first, end)):
                arguments = self._arguments(substep)
                self._launch("substep", (1, self._worlds), arguments, [None] * len(arguments))
            return
        for last in range(end, first, -self._together):
            start = max(first, last - self._together)
            self._find_slopes(start, last - start)
            gradients = [state.grad for state in self._states]
            arguments = [start, last - start, *self._slopes, *gradients]
            self._launch("sweep", self._worlds, arguments)
            self._add_up(start, last - start)

    def _arguments(self, substep: int) -> list[Any]:
        return [substep, substep, substep + 1, *self._common, *self._states, *self._states]

    def _find_slopes(self, start: int, count: int) -> None:
        """Write the derivatives of each substep's end by its beginning."""
        if not self._slopes:
            self._allocate()
        constant = [start, 0, 0, *map(constant_copy, self._common)]
        before = [constant_copy(state, start, count) for state in self._states]
        for component, (owner, place) in enumerate(self._components):
            for index, seed in enumerate(self._seeds):
                unit = np.zeros(seed.dtype._length_)
                if index == owner:
                    unit[place] = 1.0
                seed.fill_(seed.dtype(*unit))
            found = [slope[component] for slope in self._slopes]
            for slope in found:
                slope.zero_()
            arguments = [*constant, *before, *self._seeds]
            adjoints = [*[None] * len(constant), *found, *self._seeds]
            self._launch("substep", (count, self._worlds), arguments, adjoints)

    def _add_up(self, start: int, count: int) -> None:
        """Add what the substeps contribute to the gradients of the inputs."""
        before = [constant_copy(state) for state in self._states]
        arguments = [start, start, start + 1, *self._common, *before, *self._states]
        self._launch("substep", (count, self._worlds), arguments, [None] * len(arguments))

    def _allocate(self) -> None:
        shape = (self._together, self._worlds)
        for state in self._states:
            self._seeds.append(wp.zeros(shape, dtype=state.dtype, device=self._device))
            slopes = (len(self._components), *shape)
            self._slopes.append(wp.zeros(slopes, dtype=state.dtype, device=self._device))

    def _launch(
        self, name: str, dim: Any, arguments: list[Any], adjoints: list[Any] | None = None
    ) -> None:
        launch(self._kernels[name], dim, arguments, self._device, adjoints)


def component_places(structure: Structure) -> list[tuple[int, int]]:
    """Return which array of the states holds each component of a state, and where in it."""
    joints, numbers = range(structure.joint_count), range(structure.memory_count)
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
    own = [] if adjoints is None else [
        empty_struct(argument) if adjoint is None else adjoint
        for argument, adjoint in zip(arguments, adjoints, strict=True)
    ]  # fmt: skip
    wp.launch(
        kernel, dim, inputs=arguments, adj_inputs=own, adjoint=adjoints is not None,
        device=device, block_dim=GRADIENT_BLOCK,
    )  # fmt: skip


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
