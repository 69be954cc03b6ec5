"""The forces of a network around a solver: shown what the servos do, asked, held."""

from typing import Any

import torch
import warp as wp
from torch import Tensor

from tendon_newton.actuators.networks.history import History
from tendon_newton.actuators.networks.torchscript import ForceQuery
from tendon_newton.errors import InvalidParameter
from tendon_newton.simulation.hosts.network_source import NetworkForce
from tendon_newton.simulation.hosts.tendon_solver import TendonSolver

RATE_SLACK = 1.0e-6  # Relative difference of two rates that are one


class SolverServos:
    """The servos of a solver's worlds, as a source of forces sees them.

    `worlds` is a mask of those that are meant, shape (W,).
    """

    def __init__(self, solver: TendonSolver, state: Any, worlds: wp.array) -> None:
        self._solver, self._state, self._worlds = solver, state, worlds

    def sense(self, samples: History, *, fill: bool = False) -> None:
        """Add what each servo does now to its history."""
        self._solver.sense(self._state, samples, self._worlds, fill=fill)

    def hold(self, force: wp.array) -> None:
        """Hold forces [N], shape (W, D), from now on."""
        self._solver.hold(force, self._worlds)

    def settle(self) -> None:
        """Put the worlds at rest under the forces that they hold."""
        self._solver.relax(self._state, self._worlds)

    def limits(self) -> tuple[Tensor, Tensor]:
        """Return the least and the greatest forces [N], shape (W, D) each."""
        shape = (self._solver.world_count, self._solver.tendon_count)

        def of(name: str) -> Tensor:
            return wp.to_torch(self._solver.bench_numbers(name)).to(torch.float32).view(shape)

        return of("least_tension"), of("force_limit")


class HeldForce:
    """What a force network gives in the worlds of a solver."""

    def __init__(self, solver: TendonSolver, query: ForceQuery) -> None:
        device = solver.model.device
        self._solver = solver
        self._query = query
        self._network = NetworkForce(query, solver.world_count, solver.tendon_count, device)
        # What the network gave last [N], before its scale and the servo's limit, shape (W, D)
        self.history, self.force = self._network.history, self._network.force
        numbers = wp.to_torch(solver.parameters)[:, solver.table.column("learned", "force_scale")]
        # Multiplies the servo's forces [1], those between two queries too, for each of K chains,
        # shape (W, K); to write to
        self.scale: Tensor = numbers.unflatten(0, (solver.world_count, solver.chain_count))

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
        self._network.renew(SolverServos(self._solver, state, self._solver.everywhere))

    def begin(self, state: Any, chosen: wp.array, *, at_rest: bool) -> None:
        """Begin anew in the chosen worlds, shape (W,), as if their present had always been.

        Worlds that are not put at rest hold no force until the next query.
        """
        servos = SolverServos(self._solver, state, chosen)
        if at_rest:
            self._network.settle(servos)
        else:
            self._network.fill(servos)
