"""A Transformer encoder over the window, written with plain operations.

No ``nn.MultiheadAttention``: its fast paths differ between eager mode, TorchScript and ONNX, and
kernels that read the weights by name need one simple layout.
"""

import math
from collections.abc import Mapping
from typing import Any, ClassVar, Self

import torch
from torch import Tensor, nn

from tendon_newton.force_networks.force_network import INPUT_COUNT, ForceNetwork, Shapes

# Heads times the square of the window: numbers that one layer holds at once
ATTENTION_LIMIT = 1 << 24


class EncoderLayer(nn.Module):
    r"""Attention over the window, then two linear layers, each added to its input and normalised.

    .. math:: A = \operatorname{softmax}(Q K^T / \sqrt{d} + M) V

    Each head has d = width / heads numbers; dropout is a share [1] of the numbers in training.
    """

    def __init__(self, *, width: int, heads: int, feed_forward: int, dropout: float) -> None:
        super().__init__()
        self.width: int = width
        self.heads: int = heads
        self.scale: float = 1.0 / math.sqrt(width / heads)
        self.query_key_value = nn.Linear(width, 3 * width)
        self.mix = nn.Linear(width, width)
        self.norm_1 = nn.LayerNorm(width)
        self.feed_1 = nn.Linear(width, feed_forward)
        self.feed_2 = nn.Linear(feed_forward, width)
        self.norm_2 = nn.LayerNorm(width)
        self.dropout = nn.Dropout(dropout)

    def forward(self, x: Tensor, mask: Tensor, last: bool) -> Tensor:
        """Return the encoded samples.

        The mask (L, L) of 0 or minus infinity is added to the attention's logits. Samples have the
        shape (W, L, width), (W, 1, width) where only the last one is wanted.
        """
        length = x.shape[1]
        projected = self.query_key_value(x)
        query, key, value = projected.split(self.width, dim=2)
        if last:
            x, query, mask = x[:, -1:], query[:, -1:], mask[-1:]
        shape = [-1, length, self.heads, self.width // self.heads]
        query = query.reshape(-1, query.shape[1], self.heads, self.width // self.heads)
        query = (query * self.scale).transpose(1, 2)
        logits = query @ key.reshape(shape).permute(0, 2, 3, 1)
        weights = self.dropout(torch.softmax(logits + mask, dim=3))
        mixed = (weights @ value.reshape(shape).transpose(1, 2)).transpose(1, 2).flatten(2)
        x = self.norm_1(x + self.dropout(self.mix(mixed)))
        fed = self.feed_2(self.dropout(torch.relu(self.feed_1(x))))
        return self.norm_2(x + self.dropout(fed))


class Transformer(ForceNetwork):
    """Projection, sinusoidal positions, encoder layers, and a perceptron on the last sample.

    Calling it encodes the whole window; `last_query` gives the same tension and, in the last layer,
    encodes only the sample that is read.

    Source: Yuryev and Hughes, Tendon Force Modeling for Sim2Real Transfer (2026), section II-B.

    Args:
        window: Samples in a window.
        width: Numbers per sample.
        layers: Encoder layers.
        heads: Attention heads.
        feed_forward: Units between the two linear layers of an encoder layer.
        causal: Whether a sample sees only itself and earlier ones.
        dropout: Share of numbers dropped in training [1].
    """

    sizes: ClassVar[Mapping[str, Mapping[str, Any]]] = {
        "paper": {},
        "authors": {"causal": False, "dropout": 0.1},
        "matched": {},
    }

    positions: Tensor
    mask: Tensor

    def __init__(
        self,
        window: int,
        *,
        width: int = 16,
        layers: int = 2,
        heads: int = 4,
        feed_forward: int = 64,
        causal: bool = True,
        dropout: float = 0.0,
    ) -> None:
        super().__init__(window)
        self.project = nn.Linear(INPUT_COUNT, width)
        self.encoder = nn.ModuleList(
            EncoderLayer(width=width, heads=heads, feed_forward=feed_forward, dropout=dropout)
            for _ in range(layers)
        )
        self.head = nn.Sequential(
            nn.Linear(width, 8), nn.ReLU(), nn.Linear(8, 4), nn.ReLU(), nn.Linear(4, 1)
        )
        self.register_buffer("positions", sinusoidal_positions(window, width))
        hidden = torch.full((window, window), -math.inf).triu(1)
        self.register_buffer("mask", hidden if causal else torch.zeros(window, window))

    @classmethod
    def of_weights(cls, window: int, shapes: Shapes, settings: Mapping[str, Any]) -> Self:
        """Return a network with the width and the layers of its weights."""
        heads, width = int(settings["heads"]), shapes["positions"][1]
        if heads < 1 or width % heads or heads * window**2 > ATTENTION_LIMIT:
            raise ValueError(f"{heads} heads on {width} numbers of {window} samples")
        return cls(
            window,
            width=width,
            layers=len({name.split(".")[1] for name in shapes if name.startswith("encoder.")}),
            heads=heads,
            feed_forward=shapes["encoder.0.feed_1.bias"][0],
        )

    @torch.jit.unused
    def settings(self) -> dict[str, Any]:
        """Return the number of attention heads."""
        return {"heads": self.encoder[0].heads}

    def forward(self, window: Tensor) -> Tensor:
        """Return the tension [N], shape (W,)."""
        x = self.project(self.normalised(window)) + self.positions
        for layer in self.encoder:
            x = layer(x, self.mask, False)
        return self.tension(self.head(x[:, -1]))

    @torch.jit.export
    def last_query(self, window: Tensor) -> Tensor:
        """Return the tension [N], shape (W,), with no more than the last sample needs."""
        x = self.project(self.normalised(window)) + self.positions
        for index, layer in enumerate(self.encoder):
            x = layer(x, self.mask, index == len(self.encoder) - 1)
        return self.tension(self.head(x[:, -1]))


def sinusoidal_positions(length: int, width: int) -> Tensor:
    """Return sine and cosine of each place at falling frequencies, shape (length, width).

    Source: Vaswani et al., Attention is all you need (2017), section 3.5.
    """
    place = torch.arange(length, dtype=torch.float32)[:, None]
    frequency = torch.exp(torch.arange(0, width, 2) * (-math.log(10000.0) / width))
    waves = torch.stack([torch.sin(place * frequency), torch.cos(place * frequency)], dim=2)
    return waves.flatten(1)
