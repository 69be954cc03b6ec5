"""Networks that a comparison of forces finds in folders."""

from pathlib import Path
from typing import Any

import torch

from tendon_lab.force_scoring.compared_models import load_networks
from tendon_newton.force_networks import build_network
from tendon_newton.force_networks.weights_file import write_weights
from tests.train.actuator.network_files import card_of


def written(path: Path, kind: str = "transformer", of_set: str = "paper", **changes: Any) -> Path:
    """Write a network with random weights."""
    torch.manual_seed(0)
    network = build_network(kind, of_set=of_set, window=30)
    write_weights(path, network.eval(), card_of(kind, **changes))
    return path


def test_a_folder_gives_each_network_once_and_without_code(tmp_path: Path) -> None:
    """Of a network in both forms the weights are read: its program may be a stranger's."""
    written(tmp_path / "network.safetensors")
    (tmp_path / "network.pt").write_bytes(b"PK, a program")
    (found,) = load_networks([tmp_path], trust=False)
    assert found.path.suffix == ".safetensors"
