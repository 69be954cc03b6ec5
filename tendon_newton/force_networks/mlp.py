"""A multilayer perceptron over the flattened window."""

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Self

import torch
from torch import Tensor, nn

from tendon_newton.force_networks.force_network import INPUT_COUNT, ForceNetwork, Shapes

ACTIVATIONS: dict[str, type[nn.Module]] = {"relu": nn.ReLU, "tanh": nn.Tanh}


class Mlp(ForceNetwork):
    """Linear layers with an activation between them.

    Source: Hwangbo et al., Learning agile and dynamic motor skills for legged robots (2019), who
    use two past samples; here the whole window is one vector.

    The activation is a key of ``ACTIVATIONS``.
    """

    sizes: ClassVar[Mapping[str, Mapping[str, Any]]] = {
        "paper": {"widths": (256, 128, 64)},
        "authors": {"widths": (256, 64, 16), "activation": "tanh"},
        "matched": {"widths": (56, 24, 8)},
    }

    def __init__(self, window: int, *, widths: Sequence[int], activation: str = "relu") -> None:
        super().__init__(window)
        layers: list[nn.Module] = []
        before = window * INPUT_COUNT
        for width in widths:
            layers += [nn.Linear(before, width), ACTIVATIONS[activation]()]
            before = width
        self.layers = nn.Sequential(*layers, nn.Linear(before, 1))

    @classmethod
    def of_weights(cls, window: int, shapes: Shapes, settings: Mapping[str, Any]) -> Self:
        """Return a network with the units that the weights of its layers have."""
        layers = sorted(
            (int(name.split(".")[1]), shape[0])
            for name, shape in shapes.items()
            if name.startswith("layers.") and name.endswith(".weight")
        )
        if shapes["layers.0.weight"][1] != window * INPUT_COUNT:
            raise ValueError(f"its card has a window of {window} samples")
        widths = [width for _, width in layers[:-1]]
        return cls(window, widths=widths, activation=str(settings["activation"]))

    @torch.jit.unused
    def settings(self) -> dict[str, Any]:
        """Return the name of the activation."""
        names = {kind: name for name, kind in ACTIVATIONS.items()}
        return {"activation": names[type(self.layers[1])]}

    def forward(self, window: Tensor) -> Tensor:
        """Return the tension [N], shape (W,)."""
        return self.tension(self.layers(self.normalised(window).flatten(1)))
