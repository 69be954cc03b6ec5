"""The servos of recordings that are replayed, as a source of forces sees them."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
import warp as wp

from tendon_newton.actuators.networks.history import History
from tendon_newton.data.recording import Indices
from tendon_newton.simulation.hosts.launch import Launch
from tendon_newton.simulation.kernels import history_kernels
from tendon_newton.simulation.model.assembly import KernelSet, assemble
from tendon_newton.simulation.model.kernel_arrays import samples_of
from tendon_newton.simulation.model.structure import Structure

if TYPE_CHECKING:
    from torch import Tensor  # equations run without torch


class RolloutServos:
    """The servos of all worlds of a launch, in a row of each recording.

    `rows` has the row of each recording, shape (R,).
    """

    def __init__(self, kernels: KernelSet, launch: Launch, rows: Indices) -> None:
        self._kernels, self._worlds = kernels, launch
        self._rows = wp.array(rows.astype(np.int32), dtype=wp.int32, device=launch.device)

    def look_at(self, rows: Indices) -> None:
        """Go on to other rows, shape (R,)."""
        self._rows.assign(rows)

    def sense(self, samples: History, *, fill: bool = False) -> None:
        """Add what each servo does in its row to its history."""
        sense, _ = servo_kernel_set(self._kernels.structure)
        own = self._worlds
        own.run(sense, self._rows, int(fill), own.states, samples_of(self._kernels.types, samples))

    def hold(self, force: wp.array) -> None:
        """Hold forces [N], shape (W, D), from now on."""
        _, hold = servo_kernel_set(self._kernels.structure)
        own = self._worlds
        inputs = [own.numbers, own.worlds, force, own.states]
        wp.launch(hold, own.count, inputs=inputs, device=own.device)

    def settle(self) -> None:
        """Put all worlds where their recordings start."""
        self._worlds.run(self._kernels.settle, self._worlds.states)

    def limits(self) -> tuple[Tensor, Tensor]:
        """Return the least and the greatest forces [N], shape (W, D) each."""
        own, tendons = self._worlds, self._kernels.structure.tendon_count
        bench = wp.to_torch(own.worlds.mechanism).long()

        def of(name: str) -> Any:
            return wp.to_torch(getattr(own.numbers, name)).reshape(-1, tendons)[bench].float()

        return of("least_tension"), of("force_limit")


@cache
def servo_kernel_set(structure: Structure) -> tuple[wp.Kernel, wp.Kernel]:
    """Return the kernels that show a network what a servo does and that hold what it answers."""
    assembly = assemble(structure)
    return (
        assembly.kernel(history_kernels.sense_rows_kernel),
        assembly.kernel(history_kernels.hold_rows_kernel),
    )
