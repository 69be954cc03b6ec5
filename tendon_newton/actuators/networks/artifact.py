"""A force network from its file, checked: weights alone, in a safetensors file (`weights_file`).

The file holds numbers and no code. An ONNX file of the same network is for programs without torch.
"""

import warnings
from collections.abc import Generator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import torch

from tendon_newton.data.cards.force_network_card import INPUTS, ForceNetworkCard
from tendon_newton.data.files.origin import content_hash
from tendon_newton.data.files.text_file import read_bytes
from tendon_newton.errors import InvalidNetworkFile
from tendon_newton.force_networks import FORCE_NETWORKS
from tendon_newton.force_networks.weights_file import PROMISE, card_of_weights, network_of_weights

FILE_SIZE_LIMIT = 1 << 28  # Bytes; a force network has about 1 << 17


@dataclass(frozen=True, kw_only=True)
class NetworkFile:
    """A force network that was read and checked.

    Call ``module`` with windows of shape (W, window, 3), oldest sample first, each sample as
    ``card.inputs``; it returns tension [N], shape (W,), not yet clipped. A network of ours also
    has ``last_query``, the same for less work.
    """

    path: Path
    sha256: str
    card: ForceNetworkCard
    module: torch.jit.ScriptModule


@contextmanager
def torchscript() -> Generator[None]:
    """Use TorchScript without PyTorch's advice to leave it.

    Python up to 3.13 keeps it.
    """
    with warnings.catch_warnings():
        warnings.filterwarnings(
            "ignore", r"`torch\.jit\.\w+` is deprecated", category=DeprecationWarning
        )
        yield


def load_network(path: str | Path, *, device: str = "cpu") -> NetworkFile:
    """Read a force network and check that it does what its card says.

    Args:
        path: The safetensors file.
        device: Where the weights go.

    Raises:
        InvalidNetworkFile: The file is damaged, or its network and its card disagree.
    """
    path = Path(path)
    content = read_bytes(path, InvalidNetworkFile, PROMISE, size_limit=FILE_SIZE_LIMIT)
    try:
        card = card_of_weights(content)
        if card.kind not in FORCE_NETWORKS:
            known = ", ".join(sorted(FORCE_NETWORKS))
            raise InvalidNetworkFile(f"card: kind must be one of {known}; it is {card.kind!r}")
        network = network_of_weights(content, card).to(device)
        with torchscript():
            module = cast(torch.jit.ScriptModule, torch.jit.script(network))
        check_network(module, card, device)
    except InvalidNetworkFile as error:
        raise InvalidNetworkFile(f"{path}: {error}") from error
    return NetworkFile(path=path, sha256=content_hash(content), card=card, module=module)


def check_network(module: Any, card: ForceNetworkCard, device: str) -> None:
    """Refuse a network whose tensions within its card's bounds are not finite."""
    low = torch.tensor([card.bounds[name][0] for name in INPUTS], device=device)
    high = torch.tensor([card.bounds[name][1] for name in INPUTS], device=device)
    steps = torch.linspace(0.0, 1.0, card.window, device=device)[:, None]
    windows = torch.stack([low + (high - low) * steps, high - (high - low) * steps])
    with torch.no_grad():
        tension = module(windows)
    if not bool(torch.isfinite(tension).all()):
        raise InvalidNetworkFile("must return finite tensions; a test call gave NaN or infinity")
