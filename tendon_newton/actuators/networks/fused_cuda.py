"""The Transformer's fused kernel for CUDA: a warp takes servos through the network."""

from functools import cache
from pathlib import Path
from typing import Any

import warp as wp

from tendon_newton.actuators.networks.fused_weights import Shape

LANES = 32  # Threads of a CUDA warp
WARPS = 4  # Warps of a block
TOGETHER = 2  # Servos that a warp takes at once: what a weight costs to load is shared by them
BLOCK = WARPS * LANES  # Threads of a block
# Most blocks for each multiprocessor; a block reads the weights once, and then takes servos by the
# stride of all blocks. Three are resident; eight leave none of them idle at the end (one H200).
BLOCKS_PER_PROCESSOR = 8
SOURCE = Path(__file__).with_name("fused_transformer.cuh")


def fits_cuda_kernel(shape: Shape) -> bool:
    """Tell whether a Transformer has sizes that the CUDA kernel takes."""
    window, width, heads, feed, _, _ = shape
    return window <= LANES and width == LANES // 2 and heads * 4 == width and feed % 2 == 0


def block_count(servos: int, processors: int) -> int:
    """Return how many blocks share so many servos on so many multiprocessors."""
    needed = -(-servos // (WARPS * TOGETHER))
    return min(needed, BLOCKS_PER_PROCESSOR * processors)


@cache
def transformer_on_cuda(shape: Shape) -> wp.Kernel:
    """Return the kernel; it is launched in blocks of `WARPS` warps."""
    window, width, heads, feed, causal, places = shape
    constants = {
        "WINDOW": window,
        "WIDTH": width,
        "HEADS": heads,
        "DEPTH": width // heads,
        "FEED": feed,
        "CAUSAL": int(causal),
        "WARPS": WARPS,
        "TOGETHER": TOGETHER,
        **{f"AT_{name.upper()}": place for name, place in places},
    }
    lines = [f"constexpr int {name} = {value};" for name, value in constants.items()]
    body: Any = wp.func_native("\n".join([*lines, SOURCE.read_text(encoding="utf-8")]))

    @body
    def through_network(
        ring: wp.array3d(dtype=wp.float32),  # pyright: ignore[reportInvalidTypeForm]
        newest: wp.array(dtype=wp.int32),  # pyright: ignore[reportInvalidTypeForm]
        count: int,
        weights: wp.array(dtype=wp.float32),  # pyright: ignore[reportInvalidTypeForm]
        limit: wp.float32,
        force: wp.array(dtype=wp.float32),  # pyright: ignore[reportInvalidTypeForm]
    ) -> None: ...

    def transformer_cuda_kernel(
        ring: wp.array3d(dtype=wp.float32),  # pyright: ignore[reportInvalidTypeForm]
        newest: wp.array(dtype=wp.int32),  # pyright: ignore[reportInvalidTypeForm]
        count: int,
        weights: wp.array(dtype=wp.float32),  # pyright: ignore[reportInvalidTypeForm]
        limit: wp.float32,
        force: wp.array(dtype=wp.float32),  # pyright: ignore[reportInvalidTypeForm]
    ) -> None:
        """Write the forces [N] of all servos, no more than a limit."""
        through_network(ring, newest, count, weights, limit, force)

    decorator: Any = wp.kernel
    return decorator(transformer_cuda_kernel, module="unique", enable_backward=False)
