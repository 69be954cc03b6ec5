"""The file of a force network: weights alone, or a TorchScript program.

A safetensors file holds numbers and no code (`weights_file`): it is the form to share. A
TorchScript file, a zip archive, has the card as the extra file ``card.json``; it runs its code only
if the user trusts its hash. An ONNX file of the same network is for programs without torch. Reading
a card runs nothing.
"""

import io
import warnings
from collections.abc import Generator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import torch
from torch import Tensor, nn

from tendon_newton.data.cards.force_network_card import INPUTS, ForceNetworkCard
from tendon_newton.data.cards.policy_card import PolicyCard
from tendon_newton.data.files.guarded import TooMuch, guarded
from tendon_newton.data.files.origin import content_hash
from tendon_newton.data.files.text_file import read_bytes, write_bytes
from tendon_newton.data.files.torchscript_archive import START, read_extra, refuse_damage
from tendon_newton.data.files.trust import may_run, trust_content
from tendon_newton.errors import InvalidNetworkFile, first_line
from tendon_newton.force_networks import FORCE_NETWORKS
from tendon_newton.force_networks.weights_file import SUFFIX, card_of_weights, network_of_weights

CARD_NAME = "card.json"
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

    ``torch.export`` is to replace TorchScript. But it has no single file that Python, C++ and other
    programs of this kind read with the weights by name. Python up to 3.13 keeps TorchScript.
    """
    with warnings.catch_warnings():
        warnings.filterwarnings(
            "ignore", r"`torch\.jit\.\w+` is deprecated", category=DeprecationWarning
        )
        yield


def write_network(path: Path, network: nn.Module, card: ForceNetworkCard | PolicyCard) -> None:
    """Write a network or a policy with its card as a TorchScript file, and trust it.

    Raises:
        InvalidOutput: The file cannot be written.
    """
    content = io.BytesIO()
    with torchscript():
        scripted = torch.jit.script(network.cpu().eval())
        torch.jit.save(scripted, content, _extra_files={CARD_NAME: card.to_json().encode()})
    write_bytes(path, content.getvalue())
    trust_content(content.getvalue(), path.name)


def load_network(path: str | Path, *, trust: bool = False, device: str = "cpu") -> NetworkFile:
    """Read a force network and check that it does what its card says.

    Args:
        path: The safetensors or TorchScript file.
        trust: Whether to trust a TorchScript file from now on: its code runs with the user's
            rights.
        device: Where the weights go.

    Raises:
        InvalidNetworkFile: The file is damaged, or its network and its card disagree.
        UntrustedNetworkFile: The file's hash is not on the user's list.
    """
    path = Path(path)
    content = read_content(path)
    card = card_in(content, path)
    scripted = content.startswith(START)
    try:
        if scripted and not may_run(path, content, trust=trust, instead=f"a {SUFFIX}"):
            guarded(try_content, content, card)
            trust_content(content, path.name)
        module = open_module(content, card, device)
        check_network(module, card, device)
    except (InvalidNetworkFile, TooMuch) as error:
        raise InvalidNetworkFile(f"{path}: {error}") from error
    return NetworkFile(path=path, sha256=content_hash(content), card=card, module=module)


def open_module(content: bytes, card: ForceNetworkCard, device: str) -> torch.jit.ScriptModule:
    """Return the network of a file's bytes as a TorchScript module."""
    try:
        with torchscript():
            if not content.startswith(START):
                network = network_of_weights(content, card).to(device)
                return cast(torch.jit.ScriptModule, torch.jit.script(network))
            refuse_damage(content, InvalidNetworkFile)
            return torch.jit.load(io.BytesIO(content), map_location=device).eval()
    except InvalidNetworkFile:
        raise
    except Exception as error:  # torch's reader of damaged bytes fails in any way
        raise InvalidNetworkFile(
            f"a TorchScript file that torch can read; it says: {first_line(error)}"
        ) from error


def try_content(content: bytes, card: ForceNetworkCard) -> None:
    """Try a network that the user has begun to trust, on the CPU."""
    check_network(open_module(content, card, "cpu"), card, "cpu")


def read_content(path: Path) -> bytes:
    """Read a file's bytes; the same bytes are hashed and run."""
    promise = "a force network is a safetensors or TorchScript file"
    return read_bytes(path, InvalidNetworkFile, promise, size_limit=FILE_SIZE_LIMIT)


def card_in(content: bytes, path: Path) -> ForceNetworkCard:
    """Read the card out of a file's bytes."""
    try:
        if content.startswith(START):
            text = read_extra(content, CARD_NAME, "a force network", InvalidNetworkFile)
            card = ForceNetworkCard.from_json(text)
        else:
            card = card_of_weights(content)
        if card.kind not in FORCE_NETWORKS:
            known = ", ".join(sorted(FORCE_NETWORKS))
            raise InvalidNetworkFile(f"card: kind must be one of {known}; it is {card.kind!r}")
        return card
    except InvalidNetworkFile as error:
        raise InvalidNetworkFile(f"{path}: {error}") from error


def check_network(module: Any, card: ForceNetworkCard, device: str) -> None:
    """Refuse a network that does not take the card's windows or does not return tensions."""
    low = torch.tensor([card.bounds[name][0] for name in INPUTS], device=device)
    high = torch.tensor([card.bounds[name][1] for name in INPUTS], device=device)
    steps = torch.linspace(0.0, 1.0, card.window, device=device)[:, None]
    windows = torch.stack([low + (high - low) * steps, high - (high - low) * steps])
    with torch.no_grad():
        try:
            tension = module(windows)
        except RuntimeError as error:
            raise InvalidNetworkFile(
                f"must take windows of {card.window} samples of {', '.join(INPUTS)}, as its card "
                f"says; a test call failed: {first_line(error)}"
            ) from error
    if not isinstance(tension, Tensor) or tuple(tension.shape) != (2,):
        came = tuple(tension.shape) if isinstance(tension, Tensor) else type(tension).__name__
        raise InvalidNetworkFile(
            f"must return one tension per window of {card.window} samples, as its card says, "
            f"shape (2,) for two; it is {came}"
        )
    if not bool(torch.isfinite(tension).all()):
        raise InvalidNetworkFile("must return finite tensions; a test call gave NaN or infinity")
