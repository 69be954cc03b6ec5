"""What every force network has: its window and the normalisation that travels inside its file."""

from collections.abc import Mapping
from typing import Any, ClassVar, Self

import torch
from torch import Tensor, nn

INPUT_COUNT = 3  # Numbers per sample: theta_d [rad], theta [rad], theta_dot [rad/s]

Shapes = Mapping[str, tuple[int, ...]]  # Name of a weight -> its shape


class ForceNetwork(nn.Module):
    """A map from a window of servo signals to the tension at its end.

    Call it with windows of shape (W, window, 3), oldest sample first, each sample (theta_d [rad],
    theta [rad], theta_dot [rad/s]), or the same flattened to (W, window * 3). The answer is the
    tension [N], shape (W,). The caller keeps it between zero and the servo's limit.
    """

    # Set of networks that belong together -> arguments beside the window
    sizes: ClassVar[Mapping[str, Mapping[str, Any]]]

    input_mean: Tensor
    input_scale: Tensor
    force_mean: Tensor
    force_scale: Tensor

    def __init__(self, window: int) -> None:
        super().__init__()
        self.window: int = window
        self.register_buffer("input_mean", torch.zeros(INPUT_COUNT))
        self.register_buffer("input_scale", torch.ones(INPUT_COUNT))
        self.register_buffer("force_mean", torch.zeros(()))
        self.register_buffer("force_scale", torch.ones(()))

    @classmethod
    def of_weights(cls, window: int, shapes: Shapes, settings: Mapping[str, Any]) -> Self:
        """Return a network of the sizes that the shapes of a file's weights tell.

        A file may be anybody's: whatever is wrong with it raises KeyError, IndexError, TypeError or
        ValueError before memory is taken. Shapes are those of all weights and buffers, by name.
        """
        raise NotImplementedError

    @torch.jit.unused
    def settings(self) -> dict[str, Any]:
        """Return what the shapes of the weights do not tell, as JSON takes it."""
        return {}

    def normalise_as(self, inputs: Tensor, force: Tensor) -> None:
        """Take mean and standard deviation from training data.

        Samples have the shape (N, 3), measured tensions [N] the shape (N,).
        """
        self.input_mean.copy_(inputs.mean(dim=0))
        self.input_scale.copy_(inputs.std(dim=0).clamp_min(1.0e-6))
        self.force_mean.copy_(force.mean())
        self.force_scale.copy_(force.std().clamp_min(1.0e-6))

    def normalised(self, window: Tensor) -> Tensor:
        """Return windows of numbers about one, shape (W, window, 3)."""
        return (window.reshape(-1, self.window, 3) - self.input_mean) / self.input_scale

    def tension(self, output: Tensor) -> Tensor:
        """Return the tension [N], shape (...), of a last layer's output, shape (..., 1)."""
        return output[..., 0] * self.force_scale + self.force_mean

    @torch.jit.export
    def last_query(self, window: Tensor) -> Tensor:
        """Return the tension [N], shape (W,), with no more work than the last sample needs."""
        return self.forward(window)


def parameter_count(network: nn.Module) -> int:
    """Return how many trained numbers a network has; buffers do not count."""
    return sum(parameter.numel() for parameter in network.parameters())
