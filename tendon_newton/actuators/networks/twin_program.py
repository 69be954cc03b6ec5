"""From a network to the kernel that is its compiled twin, and the numbers that the kernel reads."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from typing import Any

import warp as wp
from numpy.typing import NDArray

from tendon_newton.actuators.networks import twin_kernels, twin_layer_kernels
from tendon_newton.actuators.networks.twin_cuda import Shape, has_cuda_kernel, transformer_on_cuda
from tendon_newton.actuators.networks.twin_layers import TwinLayers, twin_layers
from tendon_newton.actuators.networks.twin_weights import (
    TwinWeights,
    is_transformer,
    twin_weights,
)
from tendon_newton.device_code.templates import Specialiser

FEW_LANES = 8
"""Servos of a thread on a CPU: the numbers in a vector register of AVX2."""
MANY_LANES = 32
"""The same for fully connected layers: what a weight costs to load is shared by more servos."""


@dataclass(frozen=True, kw_only=True)
class TwinProgram:
    """A kernel for any number of lanes, and its weights."""

    window: int
    """Samples that it looks back."""
    arrays: tuple[NDArray[Any], ...]
    """What the kernel takes between the number of servos and the limit."""
    kernel: Callable[[int], wp.Kernel]
    """(servos of a thread) -> the kernel."""
    lanes: tuple[int, ...]
    """Numbers of servos that a thread of a CPU may take, ascending."""
    cuda: wp.Kernel | None = None
    """A kernel for CUDA alone, in whose blocks warps take servos together; see `twin_cuda`."""


def twin_program(module: Any) -> TwinProgram:
    """Return the twin of a module.

    Raises:
        NoTwin: The network is of a kind without one.
    """
    if is_transformer(module):
        weights = twin_weights(module)
        shape = shape_of(weights)
        return TwinProgram(
            window=weights.window,
            arrays=(weights.values,),
            kernel=partial(transformer, shape),
            lanes=(FEW_LANES,),
            cuda=transformer_on_cuda(shape) if has_cuda_kernel(shape) else None,
        )
    layers = twin_layers(module)
    return TwinProgram(
        window=layers.window,
        arrays=(layers.values, layers.layout.ravel()),
        kernel=partial(connected, layer_shape_of(layers)),
        lanes=(FEW_LANES, MANY_LANES),
    )


def shape_of(weights: TwinWeights) -> Shape:
    """Return what decides the code of a Transformer's twin."""
    places = tuple(weights.places.items())
    return (weights.window, weights.width, weights.heads, weights.feed, weights.causal, places)


@cache
def transformer(shape: Shape, lanes: int) -> wp.Kernel:
    """Assemble the kernel of a Transformer."""
    window, width, heads, feed, causal, places = shape
    rows = partial(rows_of, lanes)
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
        "LANES": lanes,
        "WINDOW": window,
        "WIDTH": width,
        "HEADS": heads,
        "DEPTH": width // heads,
        "FEED": feed,
        "CAUSAL": causal,
        **{f"AT_{name.upper()}": place for name, place in places},
    }
    # Unrolled, the loops over tokens, heads and units compile for minutes and run no faster.
    return Specialiser(bindings).kernel(
        twin_kernels.transformer_kernel,
        f"{shape} {lanes}",
        enable_backward=False,
        module_options={"max_unroll": 1},
    )


LayerShape = tuple[int, int, int, bool, bool]
"""Window, layers before the last one, most numbers between two layers, whether the activation is
the hyperbolic tangent, whether the network is recurrent."""


def layer_shape_of(layers: TwinLayers) -> LayerShape:
    """Return what decides the code of the twin of fully connected layers."""
    hidden = len(layers.layout) - 1
    return (layers.window, hidden, layers.widest, layers.tanh, layers.recurrent)


@cache
def connected(shape: LayerShape, lanes: int) -> wp.Kernel:
    """Assemble the kernel of fully connected layers."""
    window, hidden, widest, tanh, recurrent = shape
    bindings: dict[str, Any] = {
        "Lane": wp.types.vector(length=lanes, dtype=wp.float32),
        "Units": rows_of(lanes, widest),
        "Ring": wp.array3d(dtype=wp.float32),
        "LANES": lanes,
        "WINDOW": window,
        "HIDDEN": hidden,
        "TANH": tanh,
    }
    kernels = twin_layer_kernels
    return Specialiser(bindings).kernel(
        kernels.recurrent_kernel if recurrent else kernels.perceptron_kernel,
        f"{shape} {lanes}",
        enable_backward=False,
        module_options={"max_unroll": 1},
    )


def rows_of(lanes: int, count: int) -> Any:
    """Return the type of so many numbers per servo of a thread."""
    return wp.types.matrix(shape=(count, lanes), dtype=wp.float32)
