"""The forces of a network around a solver: shown what the servos do, asked, held."""

from __future__ import annotations

from typing import Any

import torch
import warp as wp
from torch import Tensor

from tendon_newton.actuators.networks.history import History
from tendon_newton.actuators.networks.torchscript import ForceQuery
from tendon_newton.errors import InvalidParameter
from tendon_newton.simulation.hosts.balance import find_root
from tendon_newton.simulation.hosts.tendon_solver import TendonSolver

RATE_SLACK = 1.0e-6
"""Relative difference of two rates that are one."""


class HeldForce:
    """Queries a force network for all servos of a solver.

    Args:
        solver: Worlds whose actuator is `learned`.
        query: The network.
    """

    def __init__(self, solver: TendonSolver, query: ForceQuery) -> None:
        shape = (solver.world_count, solver.tendon_count)
        device = solver.model.device
        self._solver = solver
        self._query = query
        self.history = History(shape[0] * shape[1], query.window, device)
        self._held = wp.zeros(shape, dtype=wp.float32, device=device)
        self.force: Tensor = wp.to_torch(self._held)
        """What the network gave last [N], before its scale and the servo's limit, shape (W, D)."""
        numbers = wp.to_torch(solver.parameters)[:, solver.table.column("learned", "force_scale")]
        self.scale: Tensor = numbers.unflatten(0, (solver.world_count, solver.chain_count))
        """Multiplies the servo's forces [1], those between two queries too, for each of K chains,
        shape (W, K); to write to."""

    @property
    def is_warp_only(self) -> bool:
        """Whether a query is Warp's launches alone."""
        return self._query.is_warp_only

    def steps_per(self, rate: float) -> int:
        """Return how many queries fall into one control step.

        Raises:
            InvalidParameter: The network's rate is no multiple of the control rate.
        """
        ratio = self._query.rate / rate
        if ratio < 1.0 - RATE_SLACK or abs(ratio - round(ratio)) > RATE_SLACK * ratio:
            raise InvalidParameter(
                f"a network that is queried at {self._query.rate:g} Hz needs a control rate of "
                f"which that is a whole multiple; it is {rate:g} Hz"
            )
        return round(ratio)

    def renew(self, state: Any) -> None:
        """Show the network the present and hold what it answers."""
        everywhere = self._solver.everywhere
        self._solver.sense(state, self.history, everywhere)
        self._ask()
        self._solver.hold(self._held, everywhere)

    def begin(self, state: Any, chosen: wp.array, *, at_rest: bool) -> None:
        """Begin anew in the chosen worlds, shape (W,), as if their present had always been.

        Worlds that are not put at rest hold no force until the next query.
        """
        if at_rest:
            self._balance(state, chosen)
        self._fill(state, chosen)

    def _fill(self, state: Any, chosen: wp.array) -> None:
        """Let the present stand for all the past of the chosen worlds."""
        servos = wp.to_torch(chosen)[:, None].expand_as(self.force).reshape(-1)
        self._query.forget(servos)
        self._solver.sense(state, self.history, chosen, fill=True)

    def _balance(self, state: Any, chosen: wp.array) -> None:
        """Find the force that the network gives where it holds the mechanism in equilibrium."""
        limit, least = (
            wp.to_torch(self._solver.bench_numbers(name)).to(torch.float32).view_as(self.force)
            for name in ("force_limit", "least_tension")
        )

        def excess(force: Tensor) -> Tensor:
            """Return what the network gives beyond a force that holds the mechanism."""
            self.force.copy_(force)
            self._solver.hold(self._held, chosen)
            self._solver.relax(state, chosen)
            self._fill(state, chosen)
            self._ask()
            return self.force.clamp(torch.maximum(least, -limit), limit) - force

        force = find_root(excess, torch.maximum(least, -limit), limit)
        self.force.copy_(force)
        self._solver.hold(self._held, chosen)
        self._solver.relax(state, chosen)

    def _ask(self) -> None:
        """Let the network say what all servos give."""
        self._query(self.history, self._held.flatten())
