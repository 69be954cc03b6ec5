"""The Transformer's fused kernel for CUDA: a warp takes servos through the network."""

from functools import cache
from pathlib import Path
from typing import Any

import warp as wp

from tendon_newton.actuators.networks.fused_weights import Shape

LANES = 32  # Threads of a CUDA warp
WARPS = 8  # Warps of a block
BLOCK = WARPS * LANES  # Threads of a block
# Most blocks for each multiprocessor, all of them resident; a block lays out the weights once, and
# then takes servos by the stride of all blocks.
BLOCKS_PER_PROCESSOR = RESIDENT = 2
LEAST_ARCHITECTURE = 80  # Of a GPU whose tensor cores take parts of single precision
MOST_FEED = 64  # Units between the layers that leave room in a block's shared memory
SOURCE = Path(__file__).with_name("fused_transformer.cuh")


def fits_cuda_kernel(shape: Shape, architecture: int) -> bool:
    """Tell whether a Transformer has sizes that the CUDA kernel takes, and a GPU what it needs."""
    window, width, heads, feed, _, _ = shape
    sizes = window <= LANES and width == LANES // 2 and heads * 4 == width
    return sizes and feed % 8 == 0 and feed <= MOST_FEED and architecture >= LEAST_ARCHITECTURE


def block_count(servos: int, processors: int) -> int:
    """Return how many blocks share so many servos on so many multiprocessors."""
    needed = -(-servos // WARPS)
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
    return decorator(
        transformer_cuda_kernel, module="unique", enable_backward=False,
        launch_bounds=(BLOCK, RESIDENT),
    )  # fmt: skip
