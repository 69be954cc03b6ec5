"""Small policies as files, right and wrong ones, and pilots for tests."""

import warnings
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import torch
from torch import nn

from tendon_newton.data.cards.policy_card import (
    CARD_KEY,
    CARD_NAME,
    FurtherServo,
    PolicyCard,
    PolicyTraining,
)
from tendon_newton.data.cards.policy_observation import sample_of


def card_of(**changes: Any) -> PolicyCard:
    """Build the card of a policy for the virtual finger."""
    values: dict[str, Any] = {
        "command_range": (0.0, 6.28),
        "spool_radius": 0.0125,
        "servo": "xc330_t288_t",
        "force_limit": 21.0,
        "action_clip": 2.0,
        "training": PolicyTraining(seed=0, git_commit=None, version="0.1.0", force="ideal"),
    }
    return PolicyCard(**values | changes)


class Normalised(nn.Module):
    """A network behind a normalisation of its inputs, as a trained policy is exported."""

    def __init__(self, network: nn.Module, size: int = 150) -> None:
        super().__init__()
        self.network = network
        self.register_buffer("mean", torch.full((1, size), 0.3))
        self.register_buffer("scale", torch.full((1, size), 1.7))

    def forward(self, values: torch.Tensor) -> torch.Tensor:
        """Normalise and run."""
        return self.network((values - self.mean) / self.scale)


def network(activation: type[nn.Module] = nn.ELU, *, size: int = 150, seed: int = 0) -> nn.Module:
    """Build the paper's network with random weights."""
    torch.manual_seed(seed)
    layers: list[nn.Module] = []
    widths = (size, 128, 64, 32)
    for width, following in pairwise(widths):
        layers += [nn.Linear(width, following), activation()]
    return Normalised(nn.Sequential(*layers, nn.Linear(32, 1)), size).eval()


class Proportional(nn.Module):
    """A policy that closes the finger: pulls in proportion to what is left to the goal.

    The spool that brings the nominal finger to alpha is about 1.1 alpha [rad].
    """

    def forward(self, values: torch.Tensor) -> torch.Tensor:
        """Return the action for the latest sample."""
        latest = values[:, -5:]
        weights = torch.tensor([[-1.0], [0.0], [0.0], [0.0], [1.4]])
        return latest @ weights + 0.3


class TwoSided(nn.Module):
    """A policy of two servos: one closes towards the goal, the other lets out ahead of it."""

    def forward(self, values: torch.Tensor) -> torch.Tensor:
        """Return the actions for the latest sample: thetas, speeds, actions, last ones, alpha."""
        latest = values[:, -9:]
        weights = torch.zeros(9, 2)
        weights[0, 0] = weights[1, 1] = -1.0
        weights[8, 0], weights[8, 1] = 1.6, -0.9
        return latest @ weights + torch.tensor([[0.3, -0.2]])


def card_of_two(**changes: Any) -> PolicyCard:
    """Build the card of a policy for the virtual finger between two strings."""
    further = FurtherServo(
        command_range=(-1.8, 4.48), spool_radius=0.0125, servo="xc330_t288_t", force_limit=21.0
    )
    return card_of(
        **{"observation": sample_of(2), "further_servos": (further,), "goal_range": (0.0, 1.88)}
        | changes
    )


def write_onnx(path: Path, module: nn.Module, card: str | None, *, size: int = 150) -> Path:
    """Write a policy as one ONNX file."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of the exporter that PyTorch calls legacy
        torch.onnx.export(
            module,
            (torch.zeros(1, size),),
            path,
            input_names=["obs"],
            output_names=["actions"],
            dynamo=False,
        )
    if card is not None:
        model = onnx.load(path)
        model.metadata_props.add(key=CARD_KEY, value=card)
        onnx.save(model, path)
    return path


def write_torchscript(path: Path, module: nn.Module, card: str) -> Path:
    """Write a policy as a TorchScript file."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        scripted = torch.jit.script(module)
        torch.jit.save(scripted, path, _extra_files={CARD_NAME: card.encode()})
    return path


def policy_of(
    run: Callable[[np.ndarray], Any], card: PolicyCard | None = None, **changes: Any
) -> Any:
    """Make a policy of a function of the latest sample, without a file."""
    from tendon_hardware.control.policy_runner import Policy

    card = card or card_of(**changes)
    width = len(card.observation)
    return Policy(
        path=Path("made_up.onnx"),
        sha256="0" * 64,
        card=card,
        engine="test",
        run=lambda observation: np.array([np.atleast_1d(run(observation[0, -width:]))]),
    )
