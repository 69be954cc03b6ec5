"""A force network as kernels that were compiled from its weights."""

from __future__ import annotations

import logging
import warnings
from functools import cache
from typing import Any

import numpy as np
import torch
import warp as wp

from tendon_newton.actuators.networks import twin_kernels
from tendon_newton.actuators.networks.artifact import NetworkFile
from tendon_newton.actuators.networks.history import CHANNELS, History
from tendon_newton.actuators.networks.torchscript import ForceQuery, TorchScriptQuery
from tendon_newton.actuators.networks.twin_weights import NoTwin, TwinWeights, twin_weights
from tendon_newton.device_code.templates import Specialiser
from tendon_newton.force_network_card import INPUTS
from tendon_newton.recording import Array

CPU_LANES = 8
"""Servos of a thread on a CPU: the numbers in a vector register of AVX2."""
PARITY = 1.0e-4
"""Largest difference [N] to the module that a twin may show when it is loaded."""
CHECKED_WINDOWS = 64
"""Random windows that a twin is checked on when it is loaded."""

LOG = logging.getLogger(__name__)


class TwinQuery:
    """Runs a Transformer in one launch that reads the histories' ring in place.

    Args:
        module: The TorchScript module that the weights are taken from.
        rate: Samples per second [Hz].
        limit: The most that the servo gives [N].
        device: Warp device.

    Raises:
        NoTwin: The network is of another kind.
    """

    is_warp_only = True

    def __init__(self, module: Any, *, rate: float, limit: float, device: Any) -> None:
        weights = twin_weights(module)
        self._device = wp.get_device(device)
        self._lanes = 1 if self._device.is_cuda else CPU_LANES
        self._kernel = transformer(shape_of(weights), self._lanes)
        self._values = wp.array(weights.values, dtype=wp.float32, device=self._device)
        self._limit = limit
        self.window = weights.window
        self.rate = rate

    def __call__(self, history: History, force: wp.array) -> None:
        """Write the forces [N] of all servos, shape (N,)."""
        wp.launch(
            self._kernel,
            -(-history.count // self._lanes),
            inputs=[history.ring, history.newest, history.count, self._values, self._limit],
            outputs=[force],
            device=self._device,
        )

    def forget(self, chosen: torch.Tensor) -> None:
        """Drop nothing: all that a window says is in the history."""


def twin_or_module(file: NetworkFile, device: Any) -> ForceQuery:
    """Return the twin of a network, or with a warning the module where there is none.

    The two are compared on random windows within the bounds of the training.
    """
    card = file.card
    module = TorchScriptQuery(
        file.module, window=card.window, rate=card.rate, limit=card.force_limit
    )
    try:
        twin = TwinQuery(file.module, rate=card.rate, limit=card.force_limit, device=device)
    except NoTwin as reason:
        warnings.warn(f"{file.path} runs as TorchScript: {reason}", stacklevel=2)
        return module
    history = random_history(file, device)
    difference = float(np.abs(forces_of(twin, history) - forces_of(module, history)).max())
    LOG.info("%s: twin and module differ by %.2g N at most", file.path, difference)
    if not difference <= PARITY:
        warnings.warn(
            f"{file.path} runs as TorchScript: its twin differs by {difference:.2g} N, "
            f"more than {PARITY:g} N",
            stacklevel=2,
        )
        return module
    return twin


def forces_of(query: ForceQuery, history: History) -> Array:
    """Return the forces [N] that a network gives after a history, shape (N,)."""
    force = wp.zeros(history.count, dtype=wp.float32, device=history.device)
    query(history, force)
    return np.asarray(force.numpy(), dtype=np.float64)


def random_history(file: NetworkFile, device: Any) -> History:
    """Return windows of samples within the bounds of a network's training."""
    card = file.card
    generator = torch.Generator().manual_seed(0)
    share = torch.rand(card.window, CHANNELS, CHECKED_WINDOWS, generator=generator)
    low, high = (torch.tensor([card.bounds[name][k] for name in INPUTS]) for k in (0, 1))
    history = History(CHECKED_WINDOWS, card.window, device)
    history.ring.assign((low[:, None] + (high - low)[:, None] * share).numpy())
    return history


Shape = tuple[int, int, int, int, bool, tuple[tuple[str, int], ...]]
"""Window, width, heads, units of the feed-forward layer, causality, places of the blocks."""


def shape_of(weights: TwinWeights) -> Shape:
    """Return what decides a twin's code."""
    places = tuple(weights.places.items())
    return (weights.window, weights.width, weights.heads, weights.feed, weights.causal, places)


@cache
def transformer(shape: Shape, lanes: int) -> wp.Kernel:
    """Assemble the kernel of a shape."""
    window, width, heads, feed, causal, places = shape

    def rows(count: int) -> Any:
        return wp.types.matrix(shape=(count, lanes), dtype=wp.float32)

    bindings: dict[str, Any] = {
        "Lane": wp.types.vector(length=lanes, dtype=wp.float32),
        "Sample": rows(3),
        "Samples": rows(3 * window),
        "Token": rows(width),
        "Head": rows(width // heads),
        "Heads": rows(heads),
        "Tokens": rows(heads * width),
        "Short": rows(8),
        "Shorter": rows(4),
        "Ring": wp.array3d(dtype=wp.float32),
        "LANES": lanes, "WINDOW": window, "WIDTH": width, "HEADS": heads,
        "DEPTH": width // heads, "FEED": feed, "CAUSAL": causal,
        **{f"AT_{name.upper()}": place for name, place in places},
    }  # fmt: skip
    # Unrolled, the loops over tokens, heads and units compile for minutes and run no faster.
    return Specialiser(bindings).kernel(
        twin_kernels.transformer_kernel, f"{shape} {lanes}", enable_backward=False,
        module_options={"max_unroll": 1},
    )  # fmt: skip
