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

    def forget(self, chosen: torch.Tensor) -> None:
        """Drop what the network itself remembers of the chosen servos, shape (N,)."""
        ...


class ModuleQuery:
    """What all queries of a module know.

    Args:
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


class TorchScriptQuery(ModuleQuery):
    """Runs a module on the windows of all servos at once, on their device.

    A Transformer is run in its form `last_query`, which gives the same force for less work.

    The module maps windows (N, H, 3), oldest sample first, to forces [N], (N,) or (N, 1).
    """

    def __init__(self, module: Any, **options: Any) -> None:
        super().__init__(module, **options)
        self._run = module.last_query if hasattr(module, "last_query") else module

    def __call__(self, history: History, force: wp.array) -> None:
        """Write the forces [N] of all servos, shape (N,)."""
        with torch.no_grad(), single_precision():
            said = self._run(wp.to_torch(history.order())).reshape(-1)
            wp.to_torch(force).copy_(said.clamp(max=self._limit))

    def forget(self, chosen: torch.Tensor) -> None:
        """Drop nothing: all that a window says is in the history."""


class StreamingQuery(ModuleQuery):
    """Runs a recurrent module one sample at a time, its state kept from query to query.

    A servo that begins anew gets the state after a whole window of its first sample.

    The module has `initial_state`, `step` and `reset_state`; see `NetworkFile`.
    """

    def __init__(self, module: Any, **options: Any) -> None:
        super().__init__(module, **options)
        self._state: torch.Tensor | None = None
        self._fresh: torch.Tensor | None = None

    def __call__(self, history: History, force: wp.array) -> None:
        """Write the forces [N] of all servos, shape (N,)."""
        with torch.no_grad(), single_precision():
            windows = wp.to_torch(history.order())
            if self._state is None or len(self._state) != history.count:
                self._state = self.module.initial_state(history.count)
                self._fresh = torch.ones(history.count, dtype=torch.bool, device=windows.device)
            if self._fresh is not None:
                self._begin(windows)
            said, self._state = self.module.step(windows[:, -1], self._state)
            wp.to_torch(force).copy_(said.reshape(-1).clamp(max=self._limit))

    def forget(self, chosen: torch.Tensor) -> None:
        """Let the chosen servos begin anew, shape (N,)."""
        if self._fresh is None or len(self._fresh) != len(chosen):
            self._fresh = torch.zeros_like(chosen)
        self._fresh = self._fresh | chosen

    def _begin(self, windows: torch.Tensor) -> None:
        """Make the state before the newest sample of the servos that begin anew."""
        assert self._state is not None
        state = self.module.initial_state(len(windows))
        for k in range(self.window - 1):
            state = self.module.step(windows[:, k], state)[1]
        fresh = None if self._fresh is None else self._fresh[:, None]
        self._state = state if fresh is None else torch.where(fresh, state, self._state)
        self._fresh = None
