"""The forces of a network: it is shown what servos do, asked for all of them at once, and held."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import torch
import warp as wp
from torch import Tensor

from tendon_newton.actuators.networks.history import History
from tendon_newton.actuators.networks.query import with_hold
from tendon_newton.actuators.networks.torchscript import ForceQuery
from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Array, Indices
from tendon_newton.simulation.hosts.force_source import RestingServos, Servos
from tendon_newton.simulation.hosts.query_rows import query_table, with_queries
from tendon_newton.simulation.hosts.timeline import Timeline

BALANCING_STEPS = 12  # Steps of the search; it ends at the rounding of float32


@dataclass(frozen=True)
class NetworkSource:
    """Forces of a network that is asked at its own rate from a recording's first row on.

    Each query is at the row next to its instant, or at a new row where the log has none. The
    history begins as if the first sample had always been there. At such a row the log reads the
    new force.
    """

    query: ForceQuery  # The network
    is_network: ClassVar[bool] = True

    @property
    def period(self) -> float:
        """Time between two queries [s]."""
        return 1.0 / self.query.rate

    def completed(self, model: Model) -> Model:
        """Return a model that says how the force answers to the shaft.

        The network's card does where the model does not.
        """
        return with_hold(model, self.query.hold)

    def timeline(self, timeline: Timeline) -> Timeline:
        """Return a timeline with a row wherever the network is asked, from the first row on."""
        return with_queries(timeline.without_past(), self.query.rate)

    def rounds(self, times: Sequence[Array]) -> Indices:
        """Return the row of each query of each recording, `NONE_LEFT` at its end, shape (Q, R)."""
        return query_table(times, self.query.rate)

    def open(self, worlds: int, tendons: int, device: Any) -> NetworkForce:
        """Return what the network gives in W worlds of D tendons."""
        return NetworkForce(self.query, worlds, tendons, device)


class NetworkForce:
    """What a network gives in W worlds of D tendons."""

    def __init__(self, query: ForceQuery, worlds: int, tendons: int, device: Any) -> None:
        self._query = query
        self.history = History(worlds * tendons, query.window, device)
        self._held = wp.zeros((worlds, tendons), dtype=wp.float32, device=device)
        # What the network gave last [N], before its scale and the servo's limit, shape (W, D)
        self.force: Tensor = wp.to_torch(self._held)

    def renew(self, servos: Servos) -> None:
        """Show the network the present and hold what it answers."""
        servos.sense(self.history)
        self._ask()
        servos.hold(self._held)

    def fill(self, servos: RestingServos) -> None:
        """Let the present stand for all the past."""
        servos.sense(self.history, fill=True)

    def settle(self, servos: RestingServos) -> None:
        """Put worlds at rest under the forces that the network gives there."""

        def answer(force: Tensor) -> Tensor:
            self._settle_under(servos, force)
            self._ask()
            return self.force

        self._settle_under(servos, balance(answer, *servos.limits()))

    def _settle_under(self, servos: RestingServos, force: Tensor) -> None:
        """Put worlds at rest under forces [N], as if they had always been there."""
        self.force.copy_(force)
        servos.hold(self._held)
        servos.settle()
        self.fill(servos)

    def _ask(self) -> None:
        """Let the network say what all servos give."""
        self._query(self.history, self._held.flatten())


def balance(
    answer: Callable[[Tensor], Tensor], least: Tensor, limit: Tensor, steps: int = BALANCING_STEPS
) -> Tensor:
    """Return the forces [N] at which network and mechanism are in balance.

    `answer` says what the network gives where forces hold the mechanism in equilibrium.
    """
    least = torch.maximum(least, -limit)

    def excess(force: Tensor) -> Tensor:
        return answer(force).clamp(least, limit) - force

    return find_root(excess, least, limit, steps)


def find_root(
    f: Callable[[Tensor], Tensor], lower: Tensor, upper: Tensor, steps: int = BALANCING_STEPS
) -> Tensor:
    """Return where functions that are >= 0 at one end and <= 0 at the other are zero.

    By false position with the Illinois rule: the end that stays counts half the next time.
    Source: Dowell and Jarratt, A modified regula falsi method, BIT 11 (1971).
    """
    low, high = lower.clone(), upper.clone()
    at_low, at_high = f(low), f(high)
    middle = low
    kept = torch.zeros_like(low)
    for _ in range(steps):
        span = at_low - at_high
        share = torch.where(span > 0.0, at_low / span, torch.zeros_like(span)).clamp(0.0, 1.0)
        middle = low + share * (high - low)
        value = f(middle)
        above = value > 0.0
        low, at_low_new = torch.where(above, middle, low), torch.where(above, value, at_low)
        high, at_high_new = torch.where(above, high, middle), torch.where(above, at_high, value)
        side = torch.where(above, 1.0, -1.0)
        again = side == kept
        at_high = torch.where(again & above, 0.5 * at_high_new, at_high_new)
        at_low = torch.where(again & ~above, 0.5 * at_low_new, at_low_new)
        kept = side
    return middle
