"""Force networks as TorchScript modules: the reference for every faster way to run them."""

from typing import Any, Protocol

import torch
import warp as wp

from tendon_newton.actuators.networks.history import History
from tendon_newton.data.cards.force_network_card import PLAIN_HOLD, HoldLaw


def single_precision() -> Any:
    """Return a context in which CUDA's recurrent layers are exact to float32, not to 11 bits."""
    return torch.backends.cudnn.flags(enabled=True, allow_tf32=False)


class ForceQuery(Protocol):
    """Answers what N servos pull after what their history shows."""

    window: int  # Samples H that it looks back
    rate: float  # Samples per second [Hz], and queries per second
    hold: HoldLaw  # How its force answers to the shaft between two queries

    # Whether a query is Warp's launches alone, which a graph on a CPU may record
    is_warp_only: bool

    def __call__(self, history: History, force: wp.array) -> None:
        """Write the forces [N] of all servos, shape (N,)."""
        ...


class TorchScriptQuery:
    """Runs a module on the windows of all servos at once, on their device.

    A Transformer is run in its form `last_query`, which gives the same force for less work.

    Args:
        module: Maps windows (N, H, 3), oldest sample first, to forces [N], (N,) or (N, 1).
        window: Samples H of the past that it looks back.
        rate: Samples per second [Hz].
        limit: The most that the servo gives [N].
        hold: How its force answers to the shaft between two queries.
    """

    is_warp_only = False

    def __init__(
        self, module: Any, *, window: int, rate: float, limit: float, hold: HoldLaw = PLAIN_HOLD
    ) -> None:
        self.module = module
        self.window = window
        self.rate = rate
        self.hold = hold
        self._limit = limit
        self._run = module.last_query if hasattr(module, "last_query") else module

    def __call__(self, history: History, force: wp.array) -> None:
        """Write the forces [N] of all servos, shape (N,)."""
        with torch.no_grad(), single_precision():
            said = self._run(wp.to_torch(history.order())).reshape(-1)
            wp.to_torch(force).copy_(said.clamp(max=self._limit))
