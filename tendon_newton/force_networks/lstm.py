"""A long short-term memory."""

from collections.abc import Mapping
from typing import Any, ClassVar

import torch
from torch import Tensor, nn

from tendon_newton.force_networks.recurrent_network import RecurrentNetwork


class Lstm(RecurrentNetwork):
    r"""A long short-term memory with a linear layer on its output.

    .. math:: c_k = f_k \odot c_{k-1} + i_k \odot g_k, \quad h_k = o_k \odot \tanh c_k

    The gates f, i, o are logistic functions and g is a hyperbolic tangent, each of a linear map of
    the sample and of :math:`h_{k-1}`. Friction leaves a servo's force where it was for seconds; the
    sum c keeps a number for that long, which the state of an Elman network does not.

    Source: Hochreiter and Schmidhuber, Long short-term memory (1997); the gate f is that of Gers,
    Schmidhuber and Cummins, Learning to forget (2000).

    The state is output and memory of H numbers each, shape (W, 2 H).
    """

    layer = nn.LSTM
    parts: ClassVar[int] = 2
    sizes: ClassVar[Mapping[str, Mapping[str, Any]]] = {"matched": {"width": 38}}

    def advanced(self, x: Tensor, state: Tensor) -> tuple[Tensor, Tensor]:
        """Return the output, shape (W, 1, H), and the new state, shape (W, 2 H)."""
        given, memory = state.unsqueeze(0).chunk(2, dim=2)
        output, (given, memory) = self.cell(x, (given.contiguous(), memory.contiguous()))
        return output, torch.cat([given, memory], dim=2)[0]
