"""What a query of the authors' Transformer costs, in every form that a user would try.

All forms answer the same windows with the same weights. The error of each is its distance from the
network in float64. On CUDA each form is one graph.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from copy import deepcopy
from dataclasses import dataclass
from functools import cache
from typing import Any, Literal

import numpy as np
import torch
import warp as wp

from lab.benchmarks.timing import Row, best_time, memory_in_use, say
from tendon_newton.actuators.networks.artifact import torchscript
from tendon_newton.actuators.networks.fused_query import FusedQuery, forces_of
from tendon_newton.actuators.networks.history import History
from tendon_newton.actuators.networks.torchscript import ForceQuery, TorchScriptQuery
from tendon_newton.data.root_mean_square import rms
from tendon_newton.simulation.hosts.torch_bridge import Graph
from tests.physics.learned.networks import GAIN, LIMIT, RATE, WINDOW, force_network

Arithmetic = Literal["float32", "TF32", "bf16"]
OPTIONS = {"window": WINDOW, "rate": RATE, "limit": LIMIT}
COMPILED_WORLDS = (4096, 65536)
"""Sizes for which torch compiles the network, which takes a while for each."""
LESSONS = 300
SPREAD = torch.tensor([4.2, 1.8, 10.0])
"""Ranges of what the network is taught: command [rad], angle [rad], its rate [rad/s]."""
SAMPLE_PRODUCTS = 3 * 16 + 3 * 48 + 4 * 30 * 8 + 16 * 16 + 2 * 16 * 64
"""Multiplications of a sample's way through the first layer: as a token; as query, key and value;
four heads that look at 30 samples; their mixture; the layers of 64."""
LAST_PRODUCTS = 3 * 16 * 16 + 2 * 4 * 30 * 16 + 16 * 16 + 2 * 16 * 64 + 16 * 8 + 8 * 4 + 4
"""Those of the last sample's way through the second layer and the perceptron."""
NETWORK_OPERATIONS = 2 * (30 * SAMPLE_PRODUCTS + LAST_PRODUCTS)
"""Multiplications and additions of one query of the Transformer; exponentials not counted."""


class WholeNetwork(torch.nn.Module):
    """The network without its shorter form: every sample goes through both layers."""

    def __init__(self, network: torch.nn.Module) -> None:
        super().__init__()
        self.network = network

    def forward(self, window: torch.Tensor) -> torch.Tensor:
        """Return the forces [N]."""
        return self.network(window)


class RoundedQuery(TorchScriptQuery):
    """Runs a module in the arithmetic of a GPU's matrix units; sums stay in float32.

    Args:
        module: As for `TorchScriptQuery`.
        arithmetic: What the factors of matrix products are rounded to.
    """

    def __init__(self, module: Any, arithmetic: Arithmetic) -> None:
        super().__init__(module, **OPTIONS)
        self._arithmetic: Arithmetic = arithmetic

    def __call__(self, history: History, force: wp.array) -> None:
        """Write the forces [N] of all servos, shape (N,)."""
        with matrix_products(self._arithmetic):
            super().__call__(history, force)


@contextmanager
def matrix_products(arithmetic: Arithmetic) -> Iterator[None]:
    """Let torch's matrix products be as exact as named."""
    before = torch.get_float32_matmul_precision()
    torch.set_float32_matmul_precision("high" if arithmetic == "TF32" else "highest")
    try:
        with torch.autocast(
            wp.device_to_torch(wp.get_device()).split(":")[0],
            torch.bfloat16,
            enabled=arithmetic == "bf16",
            cache_enabled=False,
        ):
            yield
    finally:
        torch.set_float32_matmul_precision(before)


@dataclass(frozen=True, kw_only=True)
class Form:
    """One way to run the network."""

    name: str
    make: Callable[[Any], ForceQuery]  # Takes the network
    compiled: bool = False  # Whether torch's compiler makes it


def scripted(module: torch.nn.Module) -> Any:
    """Return a TorchScript module."""
    with torchscript():
        return torch.jit.script(module)


def compiled_query(network: Any, arithmetic: Arithmetic) -> ForceQuery:
    """Return the last query as torch's compiler makes it for one size."""
    torch.compiler.reset()
    return RoundedQuery(torch.compile(network.last_query, dynamic=False), arithmetic)


def fused(network: Any) -> FusedQuery:
    """Return the network as a kernel of ours."""
    return FusedQuery(network, rate=RATE, limit=LIMIT, device=wp.get_device())


def last_query(network: Any, arithmetic: Arithmetic = "float32") -> ForceQuery:
    """Return TorchScript that computes no more than the last sample needs."""
    return RoundedQuery(scripted(network), arithmetic)


FORMS = (
    Form(name="fused kernel", make=fused),
    Form(
        name="TorchScript, all samples",
        make=lambda n: TorchScriptQuery(scripted(WholeNetwork(n)), **OPTIONS),
    ),
    Form(name="TorchScript, last query", make=last_query),
    Form(name="TorchScript, last query, TF32", make=lambda n: last_query(n, "TF32")),
    Form(name="TorchScript, last query, bf16", make=lambda n: last_query(n, "bf16")),
    Form(name="torch.compile", make=lambda n: compiled_query(n, "float32"), compiled=True),
    Form(name="torch.compile, TF32", make=lambda n: compiled_query(n, "TF32"), compiled=True),
    Form(name="torch.compile, bf16", make=lambda n: compiled_query(n, "bf16"), compiled=True),
)


@cache
def taught_network() -> Any:
    """Return the authors' Transformer, 6,801 numbers, after a short lesson in the ideal source.

    Fingers then move like a servo's, and errors are those of numbers that were trained.
    """
    network = force_network(of_set="authors").train()
    generator = torch.Generator().manual_seed(0)
    descent = torch.optim.Adam(network.parameters(), lr=3.0e-3)
    for _ in range(LESSONS):
        windows = torch.rand(128, WINDOW, 3, generator=generator) * SPREAD
        windows[:, :, 2] -= 0.5 * SPREAD[2]
        wanted = GAIN * (windows[:, -1, 0] - windows[:, -1, 1])
        descent.zero_grad()
        torch.nn.functional.mse_loss(network(windows), wanted).backward()
        descent.step()
    return network.eval()


def authors_network() -> Any:
    """Return a copy of the taught network on the present device."""
    return deepcopy(taught_network()).to(wp.device_to_torch(wp.get_device()))


def random_windows(worlds: int, device: Any) -> History:
    """Return samples about the usual ones."""
    rng = np.random.default_rng(0)
    history = History(worlds, WINDOW, device)
    samples = np.array([2.4, 0.7, 0.0])[:, None] + rng.normal(size=(WINDOW, 3, worlds))
    history.ring.assign(samples.astype(np.float32))
    return history


def exact_forces(windows: History) -> np.ndarray:
    """Return the forces [N] of the network in float64, shape (N,)."""
    module = authors_network().double()
    with torch.no_grad():
        shown = wp.to_torch(windows.order()).double()
        return module.last_query(shown).clamp(max=LIMIT).cpu().numpy()


def network(worlds_asked: Sequence[int]) -> Iterator[Row]:
    """Check and time all forms; those of torch's compiler last, and for some sizes only."""
    sizes = [w for w in worlds_asked if w in COMPILED_WORLDS] or list(worlds_asked)[:1]
    plain = [(form, w) for w in worlds_asked for form in FORMS if not form.compiled]
    compiled = [(form, w) for w in sizes for form in FORMS if form.compiled]
    for form, worlds in plain + compiled:
        row = query_row(form, worlds)
        say(row)
        yield row


def query_row(form: Form, worlds: int) -> Row:
    """Return what a query of a form costs, and how far it is off."""
    device, before = wp.get_device(), memory_in_use()
    row: Row = {"engine": form.name, "worlds": worlds}
    query = form.make(authors_network())
    history, force = random_windows(worlds, device), wp.zeros(worlds, dtype=wp.float32)
    ask = Graph(lambda: query(history, force), device, enabled=device.is_cuda)
    error = forces_of(query, history) - exact_forces(history)
    seconds = best_time(ask, device)
    row |= {
        "largest_error_n": float(np.abs(error).max()),
        "rms_error_n": rms(error),
        "milliseconds": 1.0e3 * seconds,
        "world_steps_per_second": worlds / seconds,
        "bytes_per_world": (memory_in_use() - before) / worlds,
    }
    if device.is_cuda:
        rate = NETWORK_OPERATIONS * worlds / seconds
        row["share_of_arithmetic_limit"] = rate / arithmetic_peak()
    return row


def arithmetic_peak() -> float:
    """Return the GPU's most single-precision operations per second, from its clock."""
    properties = torch.cuda.get_device_properties(0)
    clock = 1.0e3 * getattr(properties, "clock_rate", 1.98e6)  # Hz
    return properties.multi_processor_count * 128 * 2 * clock
