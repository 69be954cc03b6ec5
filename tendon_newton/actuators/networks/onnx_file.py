"""ONNX files of networks: one file each, its card in the metadata."""

import tempfile
import warnings
from pathlib import Path
from typing import Any

import torch
from torch import Tensor, nn

from tendon_newton.data.cards.force_network_card import INPUTS, ForceNetworkCard
from tendon_newton.data.cards.policy_card import CARD_KEY, PolicyCard
from tendon_newton.data.files.text_file import write_bytes


class LastQuery(nn.Module):
    """The last query of a network as a module of its own, which is what an exporter takes."""

    def __init__(self, network: Any) -> None:
        super().__init__()
        self.network = network

    def forward(self, window: Tensor) -> Tensor:
        """Return the tension [N] at the end of each window, shape (W,)."""
        return self.network.last_query(window)


def write_onnx(path: Path, network: Any, card: ForceNetworkCard) -> None:
    """Write a force network, not a scripted one.

    The input is ``window`` (W, window, 3), oldest sample first, the output ``tension`` (W,) [N].

    Raises:
        InvalidOutput: The file cannot be written.
    """
    window = torch.zeros(1, card.window, len(INPUTS))
    write_module(path, LastQuery(network.cpu()).eval(), window, ("window", "tension"), card)


def write_module(
    path: Path,
    module: nn.Module,
    example: Tensor,
    names: tuple[str, str],
    card: ForceNetworkCard | PolicyCard,
) -> None:
    """Write a module as a single file; the first axis is the number of worlds, whatever it is.

    The exporter is the one that PyTorch calls legacy. The newer one takes 60 times as long, and
    unrolls a recurrent network into a file 30 times as large.

    Args:
        example: An input.
        names: Names of input and output.

    Raises:
        InvalidOutput: The file cannot be written.
    """
    import onnx

    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        draft = Path(folder) / "network.onnx"
        for message in ("You are using the legacy TorchScript-based ONNX", "The feature will be"):
            warnings.filterwarnings("ignore", message, category=DeprecationWarning)
        # torch's own recurrent layers branch on shapes that are fixed here, and fear for the number
        # of worlds, which their states take from the input
        warnings.filterwarnings("ignore", "Converting a tensor to a Python boolean")
        warnings.filterwarnings("ignore", "Exporting a model to ONNX with a batch_size")
        torch.onnx.export(
            module,
            (example,),
            draft,
            input_names=[names[0]],
            output_names=[names[1]],
            dynamic_axes={name: {0: "worlds"} for name in names},
            dynamo=False,
            verbose=False,
        )
        model = onnx.load(draft)
    model.metadata_props.add(key=CARD_KEY, value=card.to_json())
    write_bytes(path, model.SerializeToString())
