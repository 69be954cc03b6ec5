"""A recurrent network: over a window, or one sample at a time with its state kept."""

import torch
from torch import Tensor, nn

from tendon_newton.force_networks.force_network import INPUT_COUNT, ForceNetwork


class Rnn(ForceNetwork):
    r"""An Elman network with a linear layer on its state.

    .. math:: h_k = \tanh(W_{ih} x_k + b_{ih} + W_{hh} h_{k-1} + b_{hh})

    Windowed, the state starts at zero with every window. Streaming (`step`), each world keeps its
    state, so that the history has no end; a network meant for that is trained on every sample of
    long windows (`sequence`).

    Args:
        window: Samples in a window.
        width: Size H of the state.
    """

    def __init__(self, window: int, *, width: int) -> None:
        super().__init__(window)
        self.width: int = width
        self.cell = nn.RNN(INPUT_COUNT, width, batch_first=True)
        self.readout = nn.Linear(width, 1)

    def forward(self, window: Tensor) -> Tensor:
        """Return the tension [N] at the end of each window, shape (W,)."""
        states, _ = self.cell(self.normalised(window))
        return self.tension(self.readout(states[:, -1]))

    @torch.jit.export
    def sequence(self, window: Tensor) -> Tensor:
        """Return the tension [N] at every sample of each window, shape (W, window)."""
        states, _ = self.cell(self.normalised(window))
        return self.tension(self.readout(states))

    @torch.jit.export
    def initial_state(self, worlds: int) -> Tensor:
        """Return the state before the first sample, shape (worlds, H)."""
        return torch.zeros(
            worlds, self.width, dtype=self.input_mean.dtype, device=self.input_mean.device
        )

    @torch.jit.export
    def reset_state(self, state: Tensor, mask: Tensor) -> Tensor:
        """Return the state with the worlds of a mask, shape (W,), as before the first sample."""
        return torch.where(mask.to(torch.bool).unsqueeze(-1), torch.zeros_like(state), state)

    @torch.jit.export
    def step(self, sample: Tensor, state: Tensor) -> tuple[Tensor, Tensor]:
        """Take one sample per world.

        Args:
            sample: theta_d [rad], theta [rad], theta_dot [rad/s], shape (W, 3).
            state: What the network remembers, shape (W, H).

        Returns:
            The tension [N], shape (W,), and the new state.
        """
        x = ((sample - self.input_mean) / self.input_scale).unsqueeze(1)
        states, kept = self.cell(x, state.unsqueeze(0))
        return self.tension(self.readout(states[:, 0])), kept[0]
