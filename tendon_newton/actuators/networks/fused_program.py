"""The Transformer's fused kernel, assembled for the sizes of a network."""

from __future__ import annotations

from functools import cache, partial
from typing import Any

import warp as wp

from tendon_newton.actuators.networks import fused_kernels
from tendon_newton.actuators.networks.fused_weights import Shape
from tendon_newton.device_code.templates import Specialiser

LANES = 8
"""Servos of a thread on a CPU: the numbers in a vector register of AVX2."""


@cache
def transformer(shape: Shape, lanes: int) -> wp.Kernel:
    """Assemble the kernel of a Transformer for so many servos of a thread."""
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
        fused_kernels.transformer_kernel,
        f"{shape} {lanes}",
        enable_backward=False,
        module_options={"max_unroll": 1},
    )


def rows_of(lanes: int, count: int) -> Any:
    """Return the type of so many numbers per servo of a thread."""
    return wp.types.matrix(shape=(count, lanes), dtype=wp.float32)
