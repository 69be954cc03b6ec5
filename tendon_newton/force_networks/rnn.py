"""An Elman network."""

from collections.abc import Mapping
from typing import Any, ClassVar

from torch import Tensor, nn

from tendon_newton.force_networks.recurrent_network import RecurrentNetwork


class Rnn(RecurrentNetwork):
    r"""An Elman network with a linear layer on its state.

    .. math:: h_k = \tanh(W_{ih} x_k + b_{ih} + W_{hh} h_{k-1} + b_{hh})

    Source: Elman, Finding structure in time (1990).
    """

    layer = nn.RNN
    parts: ClassVar[int] = 1
    sizes: ClassVar[Mapping[str, Mapping[str, Any]]] = {
        "paper": {"width": 64},
        "authors": {"width": 64},
        "matched": {"width": 80},
    }

    def advanced(self, x: Tensor, state: Tensor) -> tuple[Tensor, Tensor]:
        """Return the output, shape (W, 1, H), and the new state, shape (W, H)."""
        output, kept = self.cell(x, state.unsqueeze(0))
        return output, kept[0]
