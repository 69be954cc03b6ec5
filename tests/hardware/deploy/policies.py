"""Small policies as files, right and wrong ones, and pilots for tests."""

import warnings
from collections.abc import Callable
from itertools import pairwise
from math import pi
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
from tendon_newton.data.cards.turning_task import TurningTask


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


FINGERS = 4
WIDTH = len(sample_of(FINGERS, "turn"))
TASK = TurningTask(asset="hand_ball", axis=(0.0, 1.0, 0.0), drop_distance=0.015)


class Gait(nn.Module):
    """Each finger closes until its spool has come far enough, then opens, then closes again.

    What the policy did last tells which way a finger goes. The first finger that closes is the
    index finger and its next but one; the others begin once these open.

    Args:
        closed: Spool angle at which a finger turns back [rad].
        opened: Spool angle at which a finger closes again [rad].
        pull: Action while closing, and with the other sign while opening [rad].
    """

    def __init__(self, closed: float = 2.4, opened: float = 0.9, pull: float = 2.0) -> None:
        super().__init__()
        self.closed, self.opened, self.pull = closed, opened, pull

    def forward(self, values: torch.Tensor) -> torch.Tensor:
        """Return the action of each servo for the latest sample."""
        latest = values[:, -WIDTH:]
        theta, last = latest[:, :FINGERS], latest[:, 2 * FINGERS : 3 * FINGERS]
        turning_point = torch.where(last > 0.0, self.closed, self.opened)
        return torch.where(theta < turning_point, self.pull, -self.pull)


def turning_card(**changes: object) -> PolicyCard:
    """Build the card of a policy that turns a ball in the virtual hand."""
    servo = {
        "command_range": (-1.0, 6.28),
        "pay_out": (0.0, 0.3),
        "spool_radius": 0.0125,
        "servo": "xc330_t288_t",
        "force_limit": 21.0,
    }
    further = tuple(FurtherServo(**servo) for _ in range(FINGERS - 1))  # pyright: ignore
    values: dict[str, object] = {
        **servo,
        "further_servos": further,
        "observation": sample_of(FINGERS, "turn"),
        "history": 2,
        "goal_range": (0.5, 1.5),
        "action_clip": pi,
        "turning": TASK,
    }
    return card_of(**values | changes)


def write_gait(path: Path, gait: Gait | None = None, **changes: object) -> Path:
    """Write the gait as a policy's file."""
    card = turning_card(**changes)
    return write_onnx(path, gait or Gait(), card.to_json(), size=card.observation_size)
