"""Weights alone: the same network without a program, and nothing that a file says is believed."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from safetensors.torch import load, save

from tendon_lab.force_scoring.compared_models import load_networks
from tendon_newton.actuators.networks.artifact import load_network, read_card
from tendon_newton.errors import InvalidNetworkFile
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


Change = Callable[[dict[str, torch.Tensor], dict[str, str]], None]

CHANGES: dict[str, tuple[Change, str]] = {
    "a weight too few": (lambda w, m: w.__delitem__("head.4.bias"), "head.4.bias"),
    "a weight too many": (lambda w, m: w.update(extra=torch.zeros(1)), "extra has the shape"),
    "another width": (lambda w, m: w.update({"project.bias": torch.zeros(8)}), "project.bias"),
    "no head": (lambda w, m: w.__delitem__("positions"), "positions"),
    "no card": (lambda w, m: m.__delitem__("card"), "has the key 'card'"),
    "no settings": (lambda w, m: m.__delitem__("network"), "'heads'"),
    "no numbers": (lambda w, m: w.update({"head.4.bias": torch.tensor([np.nan])}), "finite"),
    "heads for ever": (lambda w, m: m.update(network='{"heads": 10000000}'), "10000000 heads"),
    "heads of none": (lambda w, m: m.update(network='{"heads": 0}'), "0 heads"),
    "deep settings": (lambda w, m: m.update(network=100_000 * "["), "must hold the weights"),
    "a window of gigabytes": (
        lambda w, m: m.update(card=json.dumps(json.loads(m["card"]) | {"window": 10_000})),
        "4 heads on 16 numbers of 10000 samples",
    ),
}


@pytest.mark.parametrize("case", CHANGES)
def test_weights_that_are_none_of_a_network_are_refused(tmp_path: Path, case: str) -> None:
    """Before memory is taken for what the file claims, the names and shapes must agree."""
    change, said = CHANGES[case]
    path = written(tmp_path / "network.safetensors")
    content = path.read_bytes()
    weights = load(content)
    head = json.loads(content[8 : 8 + int.from_bytes(content[:8], "little")])
    metadata = head["__metadata__"]
    change(weights, metadata)
    path.write_bytes(save(weights, metadata))
    with pytest.raises(InvalidNetworkFile, match=said):
        load_network(path)


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"junk",
        b"\xff" * 100,
        (8).to_bytes(8, "little") + b"{}",
        bytes(1 << 20),
        (20).to_bytes(8, "little") + b"[[[[[[[[[[[[[[[[[[[[[[[[",
    ],
)
def test_a_file_that_is_none_is_named(tmp_path: Path, content: bytes) -> None:
    """Whatever the head claims."""
    path = tmp_path / "network.safetensors"
    path.write_bytes(content)
    with pytest.raises(InvalidNetworkFile, match=r"network\.safetensors: "):
        read_card(path)
