"""A force network as weights alone: a safetensors file, which holds numbers and no program.

The metadata has the card, as in the other formats. Under ``network`` stands what the shapes of the
weights do not tell: the heads of a Transformer, the activation of a perceptron. The program that
reads it builds the network from its own classes, so that nobody needs to be trusted.
"""

import json
from pathlib import Path

import torch
from torch import Tensor

from tendon_newton.data.cards.force_network_card import ForceNetworkCard
from tendon_newton.data.files.text_file import write_bytes
from tendon_newton.errors import InvalidNetworkFile
from tendon_newton.force_networks import find_force_network
from tendon_newton.force_networks.force_network import ForceNetwork

SUFFIX = ".safetensors"
CARD_KEY, NETWORK_KEY = "card", "network"
# Bytes of names, shapes and metadata; safetensors itself allows a hundred times as many
HEADER_LIMIT = 1 << 20
# What a network's own class makes of numbers and shapes that are not its own
DAMAGED = (LookupError, TypeError, ValueError, AttributeError, RuntimeError, ArithmeticError)


def write_weights(path: Path, network: ForceNetwork, card: ForceNetworkCard) -> None:
    """Write a network, not a scripted one, as a safetensors file.

    Raises:
        InvalidOutput: The file cannot be written.
    """
    from safetensors.torch import save

    weights = {name: value.detach().cpu().contiguous() for name, value in state_of(network).items()}
    metadata = {CARD_KEY: card.to_json(), NETWORK_KEY: json.dumps(network.settings())}
    write_bytes(path, save(weights, metadata))


def state_of(network: ForceNetwork) -> dict[str, Tensor]:
    """Return all numbers of a network by name."""
    return dict(network.state_dict())


def card_of_weights(content: bytes) -> ForceNetworkCard:
    """Return the card in a safetensors file's bytes.

    Raises:
        InvalidNetworkFile: They are none, or have no card.
    """
    metadata = metadata_of(content)
    if CARD_KEY not in metadata:
        raise InvalidNetworkFile(
            f"a force network's metadata has the key {CARD_KEY!r} with its card; this file has none"
        )
    return ForceNetworkCard.from_json(metadata[CARD_KEY])


def metadata_of(content: bytes) -> dict[str, str]:
    """Return the texts in the head of a safetensors file."""
    size = int.from_bytes(content[:8], "little")
    if not 2 <= size <= min(HEADER_LIMIT, len(content) - 8):
        raise InvalidNetworkFile(
            "a force network is a safetensors or TorchScript file; this one is damaged, cut short "
            "or something else"
        )
    try:
        head = json.loads(content[8 : 8 + size])
        metadata = head.get("__metadata__", {})
        return {str(key): str(value) for key, value in metadata.items()}
    except (ValueError, AttributeError, RecursionError) as error:
        raise InvalidNetworkFile(f"the head of a safetensors file must be JSON: {error}") from error


def network_of_weights(content: bytes, card: ForceNetworkCard) -> ForceNetwork:
    """Build the network of a safetensors file from this program's own classes.

    Raises:
        InvalidNetworkFile: The file is damaged, or is none of the networks that the card can name.
    """
    from safetensors import SafetensorError
    from safetensors.torch import load

    family = find_force_network(card.kind)
    try:
        weights = load(content)
        settings = json.loads(metadata_of(content).get(NETWORK_KEY, "{}"))
        shapes = {name: tuple(value.shape) for name, value in weights.items()}
        with torch.device("meta"):  # no memory is taken before the shapes are known to agree
            network = family.of_weights(card.window, shapes, settings)
        expected = {name: tuple(value.shape) for name, value in state_of(network).items()}
    except (SafetensorError, *DAMAGED) as error:
        raise InvalidNetworkFile(
            f"must hold the weights of a {card.kind}, by their names; it does not "
            f"({type(error).__name__}: {str(error)[:200]})"
        ) from error
    if shapes != expected:
        wrong = sorted(
            name for name in shapes.keys() | expected if shapes.get(name) != expected.get(name)
        )
        raise InvalidNetworkFile(
            f"must hold the weights of a {card.kind}, by their names; {wrong[0]} has the shape "
            f"{shapes.get(wrong[0])}, and {expected.get(wrong[0])} is needed"
        )
    network.load_state_dict({name: value.float() for name, value in weights.items()}, assign=True)
    return network.requires_grad_(False).eval()
