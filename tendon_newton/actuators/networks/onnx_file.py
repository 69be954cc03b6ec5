"""The ONNX file of a force network: one file, its card in the metadata.

The input is ``window`` (W, window, 3), oldest sample first, the output ``tension`` (W,) [N].
"""

import tempfile
import warnings
from pathlib import Path
from typing import Any

import torch
from torch import Tensor, nn

from tendon_newton.data.cards.force_network_card import INPUTS, ForceNetworkCard
from tendon_newton.data.files.text_file import write_bytes

CARD_KEY = "card"


class LastQuery(nn.Module):
    """The last query of a network as a module of its own, which is what an exporter takes."""

    def __init__(self, network: Any) -> None:
        super().__init__()
        self.network = network

    def forward(self, window: Tensor) -> Tensor:
        """Return the tension [N] at the end of each window, shape (W,)."""
        return self.network.last_query(window)


def write_onnx(path: Path, network: Any, card: ForceNetworkCard) -> None:
    """Write a network, not a scripted one, as a single ONNX file for any number of worlds.

    Raises:
        InvalidOutput: The file cannot be written.
    """
    import onnx

    window = torch.zeros(1, card.window, len(INPUTS))
    with tempfile.TemporaryDirectory() as folder:
        draft = Path(folder) / "network.onnx"
        export(LastQuery(network.cpu()).eval(), (window,), draft, ["window"], ["tension"])
        model = onnx.load(draft)
    model.metadata_props.add(key=CARD_KEY, value=card.to_json())
    write_bytes(path, model.SerializeToString())


def export(
    module: nn.Module,
    arguments: tuple[Tensor, ...],
    path: Path,
    inputs: list[str],
    outputs: list[str],
) -> None:
    """Run the exporter; the first axis of everything is the number of worlds.

    The exporter is the one that PyTorch calls legacy. The newer one takes 60 times as long, and
    unrolls a recurrent network into a file 30 times as large.
    """
    axes = {name: {0: "worlds"} for name in (*inputs, *outputs)}
    with warnings.catch_warnings():
        for message in ("You are using the legacy TorchScript-based ONNX", "The feature will be"):
            warnings.filterwarnings("ignore", message, category=DeprecationWarning)
        # torch's own recurrent layers branch on shapes that are fixed here, and fear for the number
        # of worlds, which their states take from the input
        warnings.filterwarnings("ignore", "Converting a tensor to a Python boolean")
        warnings.filterwarnings("ignore", "Exporting a model to ONNX with a batch_size")
        torch.onnx.export(
            module,
            arguments,
            path,
            input_names=inputs,
            output_names=outputs,
            dynamic_axes=axes,
            dynamo=False,
            verbose=False,
        )
