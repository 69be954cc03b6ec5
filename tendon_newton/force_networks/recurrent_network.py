"""What recurrent networks share: over a window, or one sample at a time with the state kept."""

from collections.abc import Callable, Mapping
from typing import Any, ClassVar, Self

import torch
from torch import Tensor, nn

from tendon_newton.force_networks.force_network import INPUT_COUNT, ForceNetwork, Shapes


class RecurrentNetwork(ForceNetwork):
    """One recurrent layer with a linear layer on its output.

    Windowed, the state starts at zero with every window. Streaming (`step`), each world keeps its
    state, so that the history has no end; a network meant for that is trained on every sample of
    long windows (`sequence`). The state is one tensor of shape (W, S), whatever its parts are.
    """

    layer: ClassVar[Callable[..., nn.RNNBase]]  # Class of the recurrent layer
    parts: ClassVar[int]  # Tensors of H numbers in a world's state; S = parts H
    methods: ClassVar[tuple[str, ...]] = ("forward", "step")

    def __init__(self, window: int, *, width: int) -> None:
        super().__init__(window)
        self.state_size: int = self.parts * width
        self.cell = self.layer(INPUT_COUNT, width, batch_first=True)
        self.readout = nn.Linear(width, 1)

    @classmethod
    def of_weights(cls, window: int, shapes: Shapes, settings: Mapping[str, Any]) -> Self:
        """Return a network as wide as the weights of its last layer."""
        return cls(window, width=shapes["readout.weight"][1])

    def forward(self, window: Tensor) -> Tensor:
        """Return the tension [N] at the end of each window, shape (W,)."""
        outputs, _ = self.cell(self.normalised(window))
        return self.tension(self.readout(outputs[:, -1]))

    @torch.jit.export
    def sequence(self, window: Tensor) -> Tensor:
        """Return the tension [N] at every sample of each window, shape (W, window)."""
        outputs, _ = self.cell(self.normalised(window))
        return self.tension(self.readout(outputs))

    @torch.jit.export
    def initial_state(self, worlds: int) -> Tensor:
        """Return the state before the first sample, shape (worlds, S)."""
        return torch.zeros(
            worlds, self.state_size, dtype=self.input_mean.dtype, device=self.input_mean.device
        )

    @torch.jit.export
    def reset_state(self, state: Tensor, mask: Tensor) -> Tensor:
        """Return the state with the worlds of a mask, shape (W,), as before the first sample."""
        return torch.where(mask.to(torch.bool).unsqueeze(-1), torch.zeros_like(state), state)

    @torch.jit.export
    def step(self, sample: Tensor, state: Tensor) -> tuple[Tensor, Tensor]:
        """Take a sample (W, 3) and a state (W, S); return the tension [N], (W,), and a state."""
        x = ((sample - self.input_mean) / self.input_scale).unsqueeze(1)
        output, kept = self.advanced(x, state)
        return self.tension(self.readout(output[:, 0])), kept

    def advanced(self, x: Tensor, state: Tensor) -> tuple[Tensor, Tensor]:
        """Return the layer's output, shape (W, 1, H), for one sample, and the new state."""
        raise NotImplementedError
