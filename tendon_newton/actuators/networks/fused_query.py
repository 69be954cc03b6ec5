"""A Transformer as one kernel that was made for its sizes and reads its weights."""

import logging
import warnings
from functools import cache, partial
from typing import Any

import numpy as np
import torch
import warp as wp

from tendon_newton.actuators.networks import fused_kernels
from tendon_newton.actuators.networks.artifact import NetworkFile
from tendon_newton.actuators.networks.fused_cuda import (
    BLOCK,
    block_count,
    fits_cuda_kernel,
    transformer_on_cuda,
)
from tendon_newton.actuators.networks.fused_weights import (
    NoFusedKernel,
    Shape,
    fused_weights,
    is_transformer,
)
from tendon_newton.actuators.networks.history import CHANNELS, History
from tendon_newton.actuators.networks.torchscript import ForceQuery, TorchScriptQuery
from tendon_newton.data.cards.force_network_card import INPUTS, PLAIN_HOLD
from tendon_newton.data.recording import Array
from tendon_newton.device_code.templates import Bindings, Specialiser

LANES = 8  # Servos of a thread on a CPU: the numbers in a vector register of AVX2

# Largest difference [N] to the module that a fused kernel may show when it is loaded
PARITY = 1.0e-4
CHECKED_WINDOWS = 64  # Random windows that a fused kernel is checked on when it is loaded

LOG = logging.getLogger(__name__)


class FusedQuery:
    """Runs a network over a window in one launch that reads the histories' ring in place.

    The weights are the TorchScript module's; the rate is in [Hz], the servo's limit in [N].

    Raises:
        NoFusedKernel: The network is of another kind.
    """

    is_warp_only = True
    hold = PLAIN_HOLD

    def __init__(self, module: Any, *, rate: float, limit: float, device: Any) -> None:
        weights = fused_weights(module)
        self._device = wp.get_device(device)
        on_cuda = self._device.is_cuda and fits_cuda_kernel(weights.shape, self._device.arch)
        self._cuda_kernel = transformer_on_cuda(weights.shape) if on_cuda else None
        self._shape = weights.shape
        self._values = wp.array(weights.values, device=self._device)
        self._limit = limit
        self.window = weights.window
        self.rate = rate

    def __call__(self, history: History, force: wp.array) -> None:
        """Write the forces [N] of all servos, shape (N,)."""
        inputs = [history.ring, history.newest, history.count, self._values, self._limit]
        if self._cuda_kernel is not None:
            blocks = block_count(history.count, self._device.sm_count)
            wp.launch(
                self._cuda_kernel,
                blocks * BLOCK,
                inputs=inputs,
                outputs=[force],
                block_dim=BLOCK,
                device=self._device,
            )
            return
        lanes = 1 if self._device.is_cuda else LANES
        kernel = transformer(self._shape, lanes)
        wp.launch(
            kernel, -(-history.count // lanes), inputs=inputs, outputs=[force], device=self._device
        )

    @property
    def has_cuda_kernel(self) -> bool:
        """Whether it runs as a kernel that was written for CUDA."""
        return self._cuda_kernel is not None


def module_query(file: NetworkFile) -> TorchScriptQuery:
    """Return a network as its module."""
    card = file.card
    return TorchScriptQuery(
        file.module, window=card.window, rate=card.rate, limit=card.force_limit, hold=card.hold
    )


def fused_or_module(file: NetworkFile, device: Any) -> ForceQuery:
    """Return a network as its fused kernel, or as its module where there is none that serves.

    The two are compared on random windows within the bounds of the training.
    """
    card, module = file.card, module_query(file)
    if not is_transformer(file.module):
        return module
    try:
        fused = FusedQuery(file.module, rate=card.rate, limit=card.force_limit, device=device)
    except NoFusedKernel as reason:
        warnings.warn(f"{file.path} runs as TorchScript: {reason}", stacklevel=2)
        return module
    fused.hold = card.hold
    if wp.get_device(device).is_cuda and not fused.has_cuda_kernel:
        LOG.info("%s: the CUDA kernel takes other sizes, or a newer GPU: torch runs it", file.path)
        return module
    history = random_history(file, device)
    difference = float(np.abs(forces_of(fused, history) - forces_of(module, history)).max())
    LOG.info("%s: fused kernel and module differ by %.2g N at most", file.path, difference)
    if not difference <= PARITY:
        warnings.warn(
            f"{file.path} runs as TorchScript: its fused kernel differs by {difference:.2g} N, "
            f"more than {PARITY:g} N",
            stacklevel=2,
        )
        return module
    return fused


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


@cache
def transformer(shape: Shape, lanes: int) -> wp.Kernel:
    """Assemble the kernel of a Transformer for so many servos of a thread."""
    window, width, heads, feed, causal, places = shape
    rows = partial(rows_of, lanes)
    bindings: dict[Any, Any] = {
        fused_kernels.Lane: wp.types.vector(length=lanes, dtype=wp.float32),
        fused_kernels.Sample: rows(3),
        fused_kernels.FusedSamples: rows(3 * window),
        fused_kernels.Token: rows(width),
        fused_kernels.Head: rows(width // heads),
        fused_kernels.Heads: rows(heads),
        fused_kernels.Tokens: rows(heads * width),
        fused_kernels.FirstLayer: rows(8),
        fused_kernels.SecondLayer: rows(4),
        fused_kernels.LANES: lanes,
        fused_kernels.WINDOW: window,
        fused_kernels.WIDTH: width,
        fused_kernels.HEADS: heads,
        fused_kernels.DEPTH: width // heads,
        fused_kernels.FEED: feed,
        fused_kernels.CAUSAL: causal,
        **{fused_kernels.BLOCKS[name]: place for name, place in places},
    }
    # Unrolled, the loops over tokens, heads and units compile for minutes and run no faster.
    return Specialiser(Bindings(bindings)).kernel(
        fused_kernels.transformer_kernel,
        f"{shape} {lanes}",
        enable_backward=False,
        module_options={"max_unroll": 1},
    )


def rows_of(lanes: int, count: int) -> Any:
    """Return the type of so many numbers per servo of a thread."""
    return wp.types.matrix(shape=(count, lanes), dtype=wp.float32)
