"""Small force networks for the tests of physics: untrained, but of the size of a real force."""

from pathlib import Path
from typing import Any

import torch

from tendon_newton.actuators.networks.artifact import write_network
from tendon_newton.actuators.networks.query import with_hold
from tendon_newton.actuators.networks.torchscript import TorchScriptQuery
from tendon_newton.data.cards.force_network_card import (
    PLAIN_HOLD,
    ForceNetworkCard,
    HoldLaw,
    Training,
)
from tendon_newton.data.model_file import Model
from tendon_newton.force_networks import build_network
from tendon_newton.force_networks.force_network import ForceNetwork
from tests.made import stated_model
from tests.physics.runs import RADIUS

WINDOW = 30
RATE = 20.0  # Hz
LIMIT = 21.0  # N
GAIN = 4.2  # N/rad
HOLD = HoldLaw(stiffness=6.0, damping=10.0)  # How a servo like the paper's answers to its shaft
EFFECTS = {
    "command_delay": {"delay": 0.031},
    "gain_error": {"scale": 1.1},
    "actuator_lag": {"time_constant": 0.02},
    "coulomb_friction": {"force": 0.3},
}
"""Effects around a network: the same everywhere, so that the tests share their kernels."""


def force_network(
    kind: str = "transformer", *, of_set: str = "paper", seed: int = 0
) -> ForceNetwork:
    """Return a network with random weights whose forces look like a servo's."""
    torch.manual_seed(seed)
    network = build_network(kind, of_set=of_set, window=WINDOW).eval()
    samples = torch.tensor([2.4, 0.7, 0.0]) + torch.tensor([2.1, 0.5, 0.9]) * torch.randn(500, 3)
    network.normalise_as(samples, GAIN * (samples[:, 0] - samples[:, 1]))
    return network


def force_query(
    kind: str = "transformer", *, seed: int = 0, hold: HoldLaw = PLAIN_HOLD
) -> TorchScriptQuery:
    """Return a network that a loop can ask."""
    network = force_network(kind, seed=seed)
    return TorchScriptQuery(network, window=WINDOW, rate=RATE, limit=LIMIT, hold=hold)


def write_force_network(
    path: Path, network: ForceNetwork, kind: Any = "transformer", *, hold: HoldLaw = PLAIN_HOLD
) -> Path:
    """Write a network with its card, and return the path."""
    card = ForceNetworkCard(
        kind=kind,
        network_set="paper",
        parameter_count=sum(p.numel() for p in network.parameters()),
        window=WINDOW,
        rate=RATE,
        force_limit=LIMIT,
        bounds={"theta_d": (0.0, 6.0), "theta": (0.0, 2.0), "theta_dot": (-3.0, 3.0)},
        training=Training(recordings=(), split="untrained", seed=0, git_commit=None, version="0"),
        hold=hold,
    )
    write_network(path, network, card)
    return path


def learned_model(
    file: str = "force.pt", *, hold: HoldLaw | None = None, **effects: dict[str, float]
) -> Model:
    """Return the learned actuator with some effects, and with a law of its own if one is given."""
    model = stated_model("learned", {"file": file, "spool_radius": RADIUS}, effects)
    return model if hold is None else with_hold(model, hold)
