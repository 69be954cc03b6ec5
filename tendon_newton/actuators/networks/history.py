"""What a force network has seen: the last samples of every servo, in a ring on the device."""

from typing import Any

import warp as wp

# Numbers of a sample: motor angle asked for [rad], motor angle [rad], its rate [rad/s]
CHANNELS = 3


class History:
    """The last H samples of N servos.

    Kernels write samples with `push_sample`; networks read `ring` in place, or `windows` in order.
    The ring is contiguous over servos, so that neighbouring threads touch neighbouring numbers.

    It holds N servos, W worlds of D tendons each, and the H samples that a network sees.
    """

    def __init__(self, count: int, window: int, device: Any) -> None:
        self.count = count
        self.window = window
        self.device = device
        # What was seen, shape (H, 3, N)
        self.ring = wp.zeros((window, CHANNELS, count), dtype=wp.float32, device=device)
        # Place of each servo's newest sample in the ring, shape (N,)
        self.newest = wp.zeros(count, dtype=wp.int32, device=device)
        # Samples oldest first as `order` left them, shape (N, H, 3)
        self.windows = wp.zeros((count, window, CHANNELS), dtype=wp.float32, device=device)

    def order(self) -> Any:
        """Copy the ring to `windows`, oldest sample first, and return that."""
        wp.launch(
            order_kernel,
            (self.count, self.window),
            inputs=[self.ring, self.newest, self.window],
            outputs=[self.windows],
            device=self.device,
        )
        return self.windows


@wp.func
def push_sample(
    ring: wp.array3d(dtype=wp.float32),  # pyright: ignore[reportInvalidTypeForm]
    newest: wp.array(dtype=wp.int32),  # pyright: ignore[reportInvalidTypeForm]
    servo: int,
    sample: wp.vec3f,
    fill: int,
) -> None:
    """Add a servo's newest sample in the oldest one's place; to fill is to write every place."""
    window = ring.shape[0]
    place = newest[servo] + 1
    if place == window:
        place = 0
    newest[servo] = place
    first = place
    last = place + 1
    if fill != 0:
        first = 0
        last = window
    for k in range(first, last):
        for channel in range(3):
            ring[k, channel, servo] = sample[channel]


@wp.kernel(enable_backward=False)
def order_kernel(
    ring: wp.array3d(dtype=wp.float32),  # pyright: ignore[reportInvalidTypeForm]
    newest: wp.array(dtype=wp.int32),  # pyright: ignore[reportInvalidTypeForm]
    window: int,
    windows: wp.array3d(dtype=wp.float32),  # pyright: ignore[reportInvalidTypeForm]
) -> None:
    """Write sample k after the oldest of each servo to place k."""
    servo, k = wp.tid()  # pyright: ignore - two dimensions: two numbers
    place = (newest[servo] + 1 + k) % window
    for channel in range(3):
        windows[servo, k, channel] = ring[place, channel, servo]
