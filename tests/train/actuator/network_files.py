"""Network files for tests, right and wrong ones."""

import io
import zipfile
from pathlib import Path
from typing import Any

import torch

from tendon_newton.actuators.networks.artifact import torchscript, write_network
from tendon_newton.data.cards.force_network_card import (
    INPUTS,
    ForceNetworkCard,
    HeldOut,
    HoldLaw,
    Training,
    TrainingRecording,
)
from tendon_newton.force_networks import build_network
from tendon_newton.force_networks.weights_file import write_weights


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


def write_file(path: Path, kind: str = "mlp", *, window: int = 30, **changes: Any) -> Path:
    """Write a network file whose network looks at ``window`` samples."""
    torch.manual_seed(0)
    network = build_network(kind, of_set="paper", window=window)
    write_network(path, network, card_of(kind, **changes))
    return path


def written(path: Path, kind: str = "transformer", of_set: str = "paper", **changes: Any) -> Path:
    """Write a network with random weights."""
    torch.manual_seed(0)
    network = build_network(kind, of_set=of_set, window=30)
    write_weights(path, network.eval(), card_of(kind, **changes))
    return path


def write_foreign(path: Path, module: torch.nn.Module, card: str | None) -> Path:
    """Write any module, with any text as its card, as another program could."""
    extra = {} if card is None else {"card.json": card}
    with torchscript():
        torch.jit.save(torch.jit.script(module), str(path), _extra_files=extra)
    return path


def with_card(path: Path, text: str) -> Path:
    """Replace the card of a file, as an editor of zip files would."""
    content = io.BytesIO()
    with zipfile.ZipFile(path) as old, zipfile.ZipFile(content, "w") as new:
        for info in old.infolist():
            card = info.filename.endswith("/extra/card.json")
            new.writestr(info, text if card else old.read(info))
    path.write_bytes(content.getvalue())
    return path
