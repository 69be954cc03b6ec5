"""A chain of substeps, forwards and backwards: one after the other, or backwards all at once.

The adjoint of a state follows from that of the next one, lambda_k = J_k^T lambda_(k+1), and the
slopes J_k of a substep need no adjoint. That is used twice.

Substeps that an event has divided are few, and take three times the code of a whole one. Their
slopes are found at once, a walk only follows them, and what they add to the gradients of the inputs
comes at the end.

A GPU waits through most of a walk over few worlds: launch after launch of a few threads. There
the slopes of all substeps are found, one launch per component of the state; a sweep takes the
adjoint back along them; and one launch more gives what they add up to. With n components that
is n + 1 times the arithmetic of a walk in a small part of its time, as long as the GPU has room.
"""

from typing import Any

import numpy as np
import warp as wp

from tendon_newton.device_code.structs import (
    ContactStates,
    DividedSubsteps,
    Marks,
    Slopes,
    Span,
    StateRows,
    States,
)
from tendon_newton.device_code.templates import Bindings
from tendon_newton.simulation.model.kernel_arrays import struct_of, zeros
from tendon_newton.simulation.model.structure import Structure

TOGETHER = 2**20  # Substeps of all worlds whose slopes are found at once
# Worlds times components of the state from which on one substep at a time is as fast: what an H200
# has room for
ROOM = 20_000
# Threads of a block on CUDA: few, so that a thousand worlds reach many multiprocessors
GRADIENT_BLOCK = 64


LEAST_ROOM = 1024  # Slots for divided substeps to begin with
STATE = ("q", "v", "memory")  # Names of the arrays of a state


class SubstepChain:
    """The substeps of a differentiable rollout.

    The states are those of one segment of the run, L substeps long: all of it, or a part. `forward`
    simulates; before `backward` come `make_room` and `begin_backward`, after it `end_backward`.

    `common` is what each substep reads: the bench's numbers, the parameters, commands, schedule.
    The states are a `StateRows` struct with gradients, shape (L + 1, W). `backward` takes many
    substeps at once if asked to, by default on a GPU with room.
    """

    def __init__(
        self,
        structure: Structure,
        kernels: dict[str, wp.Kernel],
        types: Bindings,
        common: list[Any],
        states: Any,
        *,
        segments: int = 1,
        at_once: bool | None = None,
    ) -> None:
        self._kernels, self._types = kernels, types
        self._common, self._states = common, states
        self._gradients = gradients_of(states)
        self._length, self._worlds = states.q.shape[0] - 1, states.q.shape[1]
        self._device = states.q.device
        joints, numbers = range(structure.coordinate_count), range(structure.memory_count)
        places = zip(STATE, (joints, joints, numbers), strict=True)
        # Which array of the states holds each component of a state, and where in it
        self._components = [(name, place) for name, own in places for place in own]
        if at_once is None:
            at_once = self._device.is_cuda and self._worlds * len(self._components) < ROOM
        self.at_once = at_once  # Whether `backward` takes many substeps at once
        self._together = max(1, min(TOGETHER // self._worlds, self._length))
        shape = (self._length, self._worlds)
        # Divided substeps of each segment since this was set to zero, shape (segments,)
        self.counts = wp.zeros(segments, dtype=wp.int32, device=self._device)
        self._marks = struct_of(
            types,
            Marks,
            divided=wp.zeros(shape, dtype=wp.int32, device=self._device),
            contact=wp.zeros(shape, dtype=types[ContactStates], device=self._device),
            count=self.counts[:1],
        )
        self._make_list(LEAST_ROOM)
        self._seeds: Any = None
        self._slopes: Any = None

    def forward(self, first: int, end: int, segment: int = 0) -> None:
        """Simulate the substeps of a segment from `first` up to `end`, which is not one of them."""
        self._marks.count = self.counts[segment : segment + 1]
        for at in range(first, end):
            arguments = [self._substep(segment, at), at, *self._common, self._marks, self._states]
            self._launch("substep", self._worlds, arguments)

    def make_room(self) -> bool:
        """Make room for as many divided substeps as have been counted.

        Returns:
            Whether arrays have moved, so that what was captured of `backward` is of no use.
        """
        most = int(self.counts.numpy().max())
        if most <= self._listed.place.shape[0]:
            return False
        self._make_list(1 << (most - 1).bit_length())
        return True

    def begin_backward(self, length: int, segment: int = 0) -> None:
        """Find the slopes of the substeps that an event has divided."""
        self._listed.count.zero_()
        self._launch("list", (length, self._worlds), [self._marks, self._listed])
        self._gather(0, self._states, self._listed_states)
        constant = [view(value) for value in self._common]
        for component in range(len(self._components)):
            slopes = self._begin_component(component, self._listed_seeds, self._listed_slopes)
            states = view(self._listed_states, gradients=slopes)
            self._divided_back(segment, constant, states)

    def backward(self, first: int, end: int, segment: int = 0) -> None:
        """Take the adjoint of state `end` back to state `first`, and add to the inputs' gradients.

        What the states between hold already, from the readings, comes on top.
        """
        if not self.at_once:
            states = [self._states, self._states]
            for at in reversed(range(first, end)):
                span = self._span(segment, at, before=at, after=at + 1, follows=1)
                self._whole_back(span, 1, self._common, states)
            return
        for last in range(end, first, -self._together):
            start = max(first, last - self._together)
            self._find_slopes(segment, start, last - start)
            arguments = [start, last - start, self._slopes, self._gradients]
            self._launch("sweep", self._worlds, arguments)
            states = [view(self._states), self._states]
            span = self._span(segment, start, before=start, after=start + 1)
            self._whole_back(span, last - start, self._common, states)

    def end_backward(self, segment: int = 0) -> None:
        """Add to the inputs' gradients what the divided substeps contribute."""
        self._gather(1, self._gradients, self._listed_seeds)
        self._divided_back(segment, self._common, view(self._listed_states))

    def _substep(self, segment: int, at: int) -> int:
        """Return which of all substeps is one of a segment."""
        return segment * self._length + at

    def _span(self, segment: int, at: int, *, before: int, after: int, follows: int = 0) -> Any:
        """Return which substeps a launch walks back over."""
        numbers = {"at": at, "before": before, "after": after, "follows": follows}
        return struct_of(self._types, Span, substep=self._substep(segment, at), **numbers)

    def _find_slopes(self, segment: int, start: int, count: int) -> None:
        """Write the derivatives of each substep's end by its beginning."""
        if self._slopes is None:
            shape = (self._together, self._worlds)
            self._seeds = self._zeros(StateRows, *shape)
            self._slopes = self._zeros(Slopes, len(self._components), *shape)
        constant = [view(value) for value in self._common]
        seeds = view(self._seeds, gradients=arrays_of(self._seeds))
        span = self._span(segment, start, before=0, after=0)
        for component in range(len(self._components)):
            slopes = self._begin_component(component, self._seeds, self._slopes)
            own = {name: array[:count] for name, array in slopes.items()}
            states = [view(self._states, start, count, gradients=own), seeds]
            self._whole_back(span, count, constant, states)
        arguments = [start, self._listed, self._listed_slopes, self._slopes]
        self._launch("scatter", self._listed.place.shape[0], arguments)

    def _begin_component(self, component: int, seeds: Any, slopes: Any) -> dict[str, Any]:
        """Seed one component of the states with one; return its slopes, all zero."""
        owner, place = self._components[component]
        found = {}
        for name in STATE:
            seed = getattr(seeds, name)
            unit = np.zeros(seed.dtype._length_)
            if name == owner:
                unit[place] = 1.0
            seed.fill_(seed.dtype(*unit))
            found[name] = getattr(slopes, name)[component]
            found[name].zero_()
        return found

    def _whole_back(self, span: Any, count: int, common: list[Any], states: list[Any]) -> None:
        """Launch the adjoint of substeps that no event has divided."""
        arguments = [span, *common, self._marks, self._listed_slopes, *states]
        self._launch("whole", (count, self._worlds), arguments, back=True)

    def _divided_back(self, segment: int, common: list[Any], states: Any) -> None:
        """Launch the adjoint of those that one has, from what their seeds hold."""
        following = view(self._listed_seeds, gradients=arrays_of(self._listed_seeds))
        inputs = [self._substep(segment, 0), *common, self._listed]
        room = self._listed.place.shape[0]
        self._launch("divided", room, [*inputs, states, following], back=True)

    def _gather(self, later: int, source: Any, target: Any) -> None:
        arguments = [later, self._listed, source, target]
        self._launch("gather", self._listed.place.shape[0], arguments)

    def _make_list(self, room: int) -> None:
        """Allocate the list of divided substeps, and what is kept of each."""
        self._listed = struct_of(
            self._types,
            DividedSubsteps,
            count=wp.zeros(1, dtype=wp.int32, device=self._device),
            place=wp.zeros(room, dtype=wp.int32, device=self._device),
        )
        self._listed_states = self._zeros(States, room)
        self._listed_seeds = self._zeros(States, room)
        self._listed_slopes = self._zeros(StateRows, len(self._components), room)

    def _zeros(self, struct: type, *shape: int) -> Any:
        return zeros(self._types, struct, *shape, device=self._device)

    def _launch(self, name: str, dim: Any, arguments: list[Any], *, back: bool = False) -> None:
        launch(self._kernels[name], dim, arguments, self._device, back=back)


def gradients_of(states: Any) -> Any:
    """Return the gradients of a struct of arrays as a struct of the same kind."""
    out = empty_struct(states)
    for name in STATE:
        setattr(out, name, getattr(states, name).grad)
    return out


def launch(
    kernel: wp.Kernel, dim: Any, arguments: list[Any], device: Any, *, back: bool = False
) -> None:
    """Launch a kernel that has a gradient, or its adjoint, which uses the arguments' gradients.

    The kernel was made for blocks of `GRADIENT_BLOCK`.
    """
    wp.launch(
        kernel,
        dim,
        inputs=arguments,
        adj_inputs=[empty_struct(argument) for argument in arguments] if back else [],
        adjoint=back,
        device=device,
        block_dim=GRADIENT_BLOCK,
    )


def empty_struct(argument: Any) -> Any:
    """Return what stands in the place of a struct's gradients, None for anything else."""
    return argument._cls() if hasattr(argument, "_cls") else None


def arrays_of(states: Any) -> dict[str, Any]:
    """Return the arrays of a struct of states by name."""
    return {name: getattr(states, name) for name in STATE}


def view(value: Any, start: int = 0, count: int | None = None, *, gradients: Any = None) -> Any:
    """Return an array's rows, or a struct of arrays, on the same memory with other gradients.

    Gradients, none by default, are an array, or arrays by name; they stay as they are when a walk
    has read them.
    """
    copy = empty_struct(value)
    if copy is not None:
        for name in value._cls.vars:
            own = None if gradients is None else gradients[name]
            setattr(copy, name, view(getattr(value, name), start, count, gradients=own))
        return copy
    rows = value.shape[0] - start if count is None else count
    return wp.array(
        ptr=value.ptr + start * value.strides[0],
        shape=(rows, *value.shape[1:]),
        dtype=value.dtype,
        device=value.device,
        grad=gradients,
        retain_grad=gradients is not None,
    )
