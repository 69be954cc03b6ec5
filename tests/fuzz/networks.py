"""Sound models and checkpoints to spoil, and how they are read."""

from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import torch

from tendon_hardware.control.policy_runner import load_policy
from tendon_hardware.safety_rules.force_estimate import load_estimate
from tendon_newton.actuators.networks.artifact import load_network
from tendon_newton.actuators.networks.onnx_file import write_onnx as write_force_onnx
from tendon_newton.force_networks import build_network
from tendon_newton.force_networks.weights_file import write_weights
from tendon_train.actuator.fitting.checkpoint import (
    Checkpoint,
    TrainingState,
    load_checkpoint,
    save_checkpoint,
)
from tendon_train.actuator.fitting.descent import Descent
from tendon_train.policy.runs.policy_checkpoint import load_start
from tests.fuzz.mutations import flip
from tests.hardware.deploy.policies import card_of, network, write_onnx, write_torchscript
from tests.train.actuator.network_files import card_of as force_card_of
from tests.train.actuator.network_files import write_file

BACK = 4000
"""Bytes at the end of an ONNX file, where nodes, names and metadata stand behind the weights."""
SETTINGS = {"recipe": 1, "seed": 3}


def flip_structure(content: bytes, rng: Random) -> bytes:
    """Flip bytes, half of the time where the structure is and not the weights."""
    cut = len(content) - BACK if rng.random() < 0.5 else 0
    return content[:cut] + flip(content[cut:], rng)


def flip_head(content: bytes, rng: Random) -> bytes:
    """Flip bytes, most often in the head, which names and measures the weights."""
    cut = 8 + int.from_bytes(content[:8], "little") if rng.random() < 0.8 else len(content)
    return flip(content[:cut], rng) + content[cut:]


def policy_onnx(folder: Path) -> Path:
    """Write a policy."""
    return write_onnx(folder / "policy.onnx", network(), card_of().to_json())


def policy_script(folder: Path) -> Path:
    """Write a policy as a program."""
    return write_torchscript(folder / "policy.pt", network(), card_of().to_json())


def read_policy(path: Path) -> None:
    """A policy that is taken gives numbers."""
    policy = load_policy(path, trust=True)
    observation = np.zeros((1, policy.card.observation_size), dtype=np.float32)
    assert np.isfinite(policy(observation)).all()


def force_network(kind: str = "transformer") -> Any:
    """Return a network with random weights."""
    torch.manual_seed(0)
    return build_network(kind, of_set="paper", window=30).eval()


def force_onnx(folder: Path) -> Path:
    """Write a force network that guards a run."""
    write_force_onnx(folder / "force.onnx", force_network("mlp"), force_card_of())
    return folder / "force.onnx"


def read_estimate(path: Path) -> None:
    """An estimate that is taken gives numbers within its card's limit."""
    estimate = load_estimate(path, 20.0)
    assert 0.0 <= estimate(1.0, 0.5, 0.0) <= estimate.card.force_limit


def force_script(folder: Path) -> Path:
    """Write a force network as a program."""
    return write_file(folder / "force.pt", "rnn")


def force_weights(folder: Path) -> Path:
    """Write a force network as weights alone."""
    write_weights(folder / "force.safetensors", force_network(), force_card_of("transformer"))
    return folder / "force.safetensors"


def read_network(path: Path) -> None:
    """Read a force network."""
    load_network(path, trust=True)


def training_state() -> TrainingState:
    """Return the state of a training of a small network."""
    small = force_network("mlp")
    return TrainingState(
        network=small, descent=Descent(small, 1e-3), generator=torch.Generator().manual_seed(0)
    )


def checkpoint(folder: Path) -> Path:
    """Write a checkpoint of a force network's training."""
    state = training_state()
    done = Checkpoint(kept_weights=state.network.state_dict(), history=((1.0, 2.0),), epoch=1)
    save_checkpoint(folder / "checkpoint.pt", SETTINGS, state, done)
    return folder / "checkpoint.pt"


def read_checkpoint(path: Path) -> None:
    """Go on from a checkpoint."""
    load_checkpoint(path, SETTINGS, training_state())


class Learner:
    """What of rsl-rl's algorithm a checkpoint meets."""

    def __init__(self) -> None:
        self.actor = network()

    def load(self, table: dict[str, Any], parts: Any, strict: bool) -> None:
        """Take the actor's weights."""
        self.actor.load_state_dict(table["actor_state_dict"], strict=strict)


def policy_checkpoint(folder: Path) -> Path:
    """Write a checkpoint of a policy's training."""
    table = {"settings": SETTINGS, "algorithm": {"actor_state_dict": network().state_dict()}}
    torch.save(table, folder / "000001.pt")
    return folder / "000001.pt"


def read_policy_checkpoint(path: Path) -> None:
    """Begin a training from a checkpoint."""
    load_start(path, Learner(), "cpu")
