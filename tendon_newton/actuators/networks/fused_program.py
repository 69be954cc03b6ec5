"""The Transformer's fused kernel, assembled for the sizes of a network."""

from __future__ import annotations

from functools import cache, partial
from typing import Any

import warp as wp

from tendon_newton.actuators.networks import fused_kernels
from tendon_newton.actuators.networks.fused_weights import Shape
from tendon_newton.device_code.templates import Bindings, Specialiser

LANES = 8
"""Servos of a thread on a CPU: the numbers in a vector register of AVX2."""


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
