"""Network files for tests."""

from pathlib import Path
from typing import Any

import torch
from safetensors.torch import load, save

from tendon_newton.data.cards.force_network_card import (
    INPUTS,
    ForceNetworkCard,
    HeldOut,
    HoldLaw,
    Training,
    TrainingRecording,
)
from tendon_newton.force_networks import build_network
from tendon_newton.force_networks.weights_file import CARD_KEY, metadata_of, write_weights


def card_of(kind: str = "mlp", **changes: Any) -> ForceNetworkCard:
    """Build a card with everything on it."""
    values: dict[str, Any] = {
        "kind": kind,
        "network_set": "paper",
        "parameter_count": 6801,
        "window": 30,
        "rate": 20.0,
        "force_limit": 21.0,
        "bounds": dict.fromkeys(INPUTS, (-1.0, 6.3)),
        "training": Training(
            recordings=(TrainingRecording(file="a.csv", sha256="0" * 64, split="train"),),
            split="by recording",
            seed=3,
            git_commit=None,
            version="0.1.0",
        ),
        "hold": HoldLaw(stiffness=6.0, damping=10.0),
        "held_out": HeldOut(force_rmse=0.4, noise_floor=0.05, rows=800, recordings=("b.csv",)),
    }
    return ForceNetworkCard(**values | changes)


def written(path: Path, kind: str = "transformer", of_set: str = "paper", **changes: Any) -> Path:
    """Write a network with random weights."""
    torch.manual_seed(0)
    network = build_network(kind, of_set=of_set, window=30)
    write_weights(path, network.eval(), card_of(kind, **changes))
    return path


def with_card(path: Path, text: str) -> Path:
    """Replace the card of a file, as another program could."""
    weights, metadata = opened(path)
    path.write_bytes(save(weights, metadata | {CARD_KEY: text}))
    return path


def opened(path: Path) -> tuple[dict[str, torch.Tensor], dict[str, str]]:
    """Return the weights and the metadata of a file."""
    content = path.read_bytes()
    return load(content), metadata_of(content)
