"""An Elman network over a window."""

from collections.abc import Mapping
from typing import Any, ClassVar, Self

from torch import Tensor, nn

from tendon_newton.force_networks.force_network import INPUT_COUNT, ForceNetwork, Shapes


class Rnn(ForceNetwork):
    r"""An Elman network with a linear layer on its state.

    .. math:: h_k = \tanh(W_{ih} x_k + b_{ih} + W_{hh} h_{k-1} + b_{hh})

    The state starts at zero with every window.

    Source: Elman, Finding structure in time (1990).
    """

    sizes: ClassVar[Mapping[str, Mapping[str, Any]]] = {
        "paper": {"width": 64},
        "authors": {"width": 64},
        "matched": {"width": 80},
    }

    def __init__(self, window: int, *, width: int) -> None:
        super().__init__(window)
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
