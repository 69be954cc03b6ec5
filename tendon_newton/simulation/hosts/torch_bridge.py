"""Torch and Warp on one device: shared memory, shared streams, and a control step as one graph."""

from collections.abc import Callable, Generator
from contextlib import contextmanager
from typing import Any

import torch
import warp as wp

WARM_UPS = 3  # Runs before a capture: they compile and allocate, and torch's allocator settles


@contextmanager
def torch_stream(device: Any) -> Generator[None]:
    """Let Warp launch on torch's current stream, so that one waits for the other, on CUDA."""
    if not device.is_cuda:
        yield
        return
    current = torch.cuda.current_stream(wp.device_to_torch(device))
    if device.stream.cuda_stream == current.cuda_stream:
        # a second handle would take the stream's capture with it when it is dropped
        yield
        return
    with wp.ScopedStream(wp.stream_from_torch(current)):
        yield


def plain_tensor(array: wp.array) -> torch.Tensor:
    """Return a tensor on an array's memory; torch does not track what is written there."""
    return wp.to_torch(array, requires_grad=False)


class Graph:
    """A chain of launches that do the same each time: eager at first, then one graph.

    What the chain reads and writes must stay where it is. On CUDA the chain may use torch and Warp;
    on a CPU only Warp's launches are recorded, so that a chain with torch in it must stay eager.
    """

    def __init__(self, work: Callable[[], None], device: Any, *, enabled: bool = True) -> None:
        self._work = work
        self._device = device
        self._enabled = enabled
        self._eager_runs = 0
        self._replay: Callable[[], None] | None = None

    def __call__(self) -> None:
        """Run the chain once."""
        if self._replay is not None:
            self._replay()
            return
        if not self._enabled or self._eager_runs < WARM_UPS:
            with torch_stream(self._device):
                self._work()
            self._eager_runs += 1
            return
        self._replay = self._on_cuda() if self._device.is_cuda else self._on_cpu()
        self._replay()

    def _on_cpu(self) -> Callable[[], None]:
        """Record Warp's launches."""
        with wp.ScopedCapture(device=self._device) as capture:
            self._work()
        graph: Any = capture.graph
        return lambda: wp.capture_launch(graph)

    def _on_cuda(self) -> Callable[[], None]:
        """Record torch and Warp on one stream that is not the default one."""
        device = torch.device(wp.device_to_torch(self._device))
        stream = torch.cuda.Stream(device)
        warp_stream = wp.stream_from_torch(stream)
        stream.wait_stream(torch.cuda.current_stream(device))
        graph = torch.cuda.CUDAGraph()
        with wp.ScopedStream(warp_stream), torch.cuda.graph(graph, stream=stream):
            wp.capture_begin(stream=warp_stream, external=True)
            self._work()
            wp.capture_end(stream=warp_stream)
        return graph.replay
