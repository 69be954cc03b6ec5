"""A multilayer perceptron over the flattened window."""

from collections.abc import Sequence

from torch import Tensor, nn

from tendon_newton.force_networks.force_network import INPUT_COUNT, ForceNetwork

ACTIVATIONS: dict[str, type[nn.Module]] = {"relu": nn.ReLU, "tanh": nn.Tanh}


class Mlp(ForceNetwork):
    """Linear layers with an activation between them.

    Source: Hwangbo et al., Learning agile and dynamic motor skills for legged robots (2019), who
    use two past samples; here the whole window is one vector.

    Args:
        window: Samples in a window.
        widths: Units of the hidden layers.
        activation: A key of ``ACTIVATIONS``.
    """

    def __init__(self, window: int, *, widths: Sequence[int], activation: str = "relu") -> None:
        super().__init__(window)
        layers: list[nn.Module] = []
        before = window * INPUT_COUNT
        for width in widths:
            layers += [nn.Linear(before, width), ACTIVATIONS[activation]()]
            before = width
        self.layers = nn.Sequential(*layers, nn.Linear(before, 1))

    def forward(self, window: Tensor) -> Tensor:
        """Return the tension [N], shape (W,)."""
        return self.tension(self.layers(self.normalised(window).flatten(1)))
