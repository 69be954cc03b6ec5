"""An Elman network, over a window or one sample at a time with the state kept."""

from collections.abc import Mapping
from typing import Any, ClassVar, Self

import torch
from torch import Tensor, nn

from tendon_newton.force_networks.force_network import INPUT_COUNT, ForceNetwork, Shapes


class Rnn(ForceNetwork):
    r"""An Elman network with a linear layer on its state.

    .. math:: h_k = \tanh(W_{ih} x_k + b_{ih} + W_{hh} h_{k-1} + b_{hh})

    Windowed, the state starts at zero with every window. Streaming (`step`), each world keeps its
    state, so that the history has no end; a network meant for that is trained on every sample of
    long windows (`sequence`).

    Source: Elman, Finding structure in time (1990).
    """

    sizes: ClassVar[Mapping[str, Mapping[str, Any]]] = {
        "paper": {"width": 64},
        "authors": {"width": 64},
        "matched": {"width": 80},
    }
    methods: ClassVar[tuple[str, ...]] = ("forward", "step")

    def __init__(self, window: int, *, width: int) -> None:
        super().__init__(window)
        self.state_size = width
        self.cell = nn.RNN(INPUT_COUNT, width, batch_first=True)
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
        """Return the state before the first sample, shape (worlds, H)."""
        return torch.zeros(
            worlds, self.state_size, dtype=self.input_mean.dtype, device=self.input_mean.device
        )

    @torch.jit.export
    def reset_state(self, state: Tensor, mask: Tensor) -> Tensor:
        """Return the state with the worlds of a mask, shape (W,), as before the first sample."""
        return torch.where(mask.to(torch.bool).unsqueeze(-1), torch.zeros_like(state), state)

    @torch.jit.export
    def step(self, sample: Tensor, state: Tensor) -> tuple[Tensor, Tensor]:
        """Take a sample (W, 3) and a state (W, H); return the tension [N], (W,), and a state."""
        x = ((sample - self.input_mean) / self.input_scale).unsqueeze(1)
        output, kept = self.cell(x, state.unsqueeze(0))
        return self.tension(self.readout(output[:, 0])), kept[0]
