"""A force network as a kernel that was compiled from its weights."""

from __future__ import annotations

import logging
import warnings
from typing import Any

import numpy as np
import torch
import warp as wp

from tendon_newton.actuators.networks.artifact import NetworkFile
from tendon_newton.actuators.networks.history import CHANNELS, History
from tendon_newton.actuators.networks.torchscript import ForceQuery, TorchScriptQuery
from tendon_newton.actuators.networks.twin_cuda import BLOCK, block_count
from tendon_newton.actuators.networks.twin_program import twin_program
from tendon_newton.actuators.networks.twin_weights import NoTwin
from tendon_newton.data.cards.force_network_card import INPUTS, PLAIN_HOLD
from tendon_newton.data.recording import Array

PARITY = 1.0e-4
"""Largest difference [N] to the module that a twin may show when it is loaded."""
CHECKED_WINDOWS = 64
"""Random windows that a twin is checked on when it is loaded."""

LOG = logging.getLogger(__name__)


class TwinQuery:
    """Runs a network over a window in one launch that reads the histories' ring in place.

    Args:
        module: The TorchScript module that the weights are taken from.
        rate: Samples per second [Hz].
        limit: The most that the servo gives [N].
        device: Warp device.

    Raises:
        NoTwin: The network is of another kind.
    """

    is_warp_only = True
    hold = PLAIN_HOLD

    def __init__(self, module: Any, *, rate: float, limit: float, device: Any) -> None:
        program = twin_program(module)
        self._device = wp.get_device(device)
        self._kernel = program.kernel
        self._cuda_kernel = program.cuda if self._device.is_cuda else None
        self._lanes = (1,) if self._device.is_cuda else program.lanes
        self._arrays = [wp.array(values, device=self._device) for values in program.arrays]
        self._limit = limit
        self.window = program.window
        self.rate = rate

    def __call__(self, history: History, force: wp.array) -> None:
        """Write the forces [N] of all servos, shape (N,)."""
        inputs = [history.ring, history.newest, history.count, *self._arrays, self._limit]
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
        lanes = max((n for n in self._lanes if n <= history.count), default=self._lanes[0])
        groups = -(-history.count // lanes)
        kernel = self._kernel(lanes)
        wp.launch(kernel, groups, inputs=inputs, outputs=[force], device=self._device)

    @property
    def has_cuda_kernel(self) -> bool:
        """Whether it runs as a kernel that was written for CUDA."""
        return self._cuda_kernel is not None

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
    if wp.get_device(device).is_cuda and not twin.has_cuda_kernel:
        LOG.info("%s: layers this wide run faster as torch's matrix products on a GPU", file.path)
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
