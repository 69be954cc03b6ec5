"""Where a servo's force comes from: an equation inside the kernels, or a network asked around them.

A `ForceSource` is the choice; `open` gives the `Force` of some worlds, which a host renews as time
goes on. What differs between hosts (a rollout, a solver, MuJoCo) is how their servos are seen and
how they hold a force: `Servos`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, ClassVar, Protocol

import numpy as np
import warp as wp

from tendon_newton.actuators.networks.history import History
from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Array, Indices
from tendon_newton.simulation.hosts.timeline import Timeline

if TYPE_CHECKING:
    from torch import Tensor  # equations run without torch


class Servos(Protocol):
    """The servos of W worlds, whose forces are decided outside the kernels."""

    def sense(self, samples: History, *, fill: bool = False) -> None:
        """Add what each servo does now to its history; to fill is to let it stand for the past."""
        ...

    def hold(self, force: wp.array) -> None:
        """Hold forces [N], shape (W, D), from now on."""
        ...


class RestingServos(Servos, Protocol):
    """Servos that can be put at rest."""

    def settle(self) -> None:
        """Put their worlds where they start, or at rest under the forces that they hold."""
        ...

    def limits(self) -> tuple[Tensor, Tensor]:
        """Return the least and the greatest forces [N], shape (W, D) each."""
        ...


class Force(Protocol):
    """What the servos of some worlds give."""

    def renew(self, servos: Servos) -> None:
        """Decide anew what the servos give from now on."""
        ...

    def settle(self, servos: RestingServos) -> None:
        """Put worlds at rest, their forces in balance with their mechanisms."""
        ...


class ForceSource(Protocol):
    """Where the forces of an actuator come from."""

    is_network: ClassVar[bool]  # Whether a network gives them

    @property
    def period(self) -> float:
        """Time between two renewals [s]; 0 where nothing is renewed."""
        ...

    def completed(self, model: Model) -> Model:
        """Return a model with what the source adds to its actuator's numbers."""
        ...

    def timeline(self, timeline: Timeline) -> Timeline:
        """Return a timeline with a row wherever a force is renewed."""
        ...

    def rounds(self, times: Sequence[Array]) -> Indices:
        """Return the rows [1] in which forces are renewed, shape (Q, R); `NONE_LEFT` at an end."""
        ...

    def open(self, worlds: int, tendons: int, device: Any) -> Force:
        """Return the forces of W worlds of D tendons on a Warp device."""
        ...


class EquationForce:
    """An equation inside the kernels: nothing is decided outside."""

    def renew(self, servos: Servos) -> None:
        """Leave everything to the kernels."""

    def settle(self, servos: RestingServos) -> None:
        """Put worlds at rest."""
        servos.settle()


class Equation:
    """Forces that an actuator's equation gives."""

    is_network: ClassVar[bool] = False
    period = 0.0

    def completed(self, model: Model) -> Model:
        """Return the model itself."""
        return model

    def timeline(self, timeline: Timeline) -> Timeline:
        """Return the timeline itself."""
        return timeline

    def rounds(self, times: Sequence[Array]) -> Indices:
        """Return one round, from the first row on."""
        return np.zeros((1, len(times)), dtype=np.int64)

    def open(self, worlds: int, tendons: int, device: Any) -> EquationForce:
        """Return the force of an equation."""
        return EquationForce()
