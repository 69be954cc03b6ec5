"""A made-up policy that turns a ball, as a file: two fingers close while two open."""

from math import pi
from pathlib import Path

import torch
from torch import nn

from tendon_newton.data.cards.policy_card import FurtherServo, PolicyCard
from tendon_newton.data.cards.policy_observation import sample_of
from tendon_newton.data.cards.turning_task import TurningTask
from tests.hardware.deploy.policies import card_of, write_onnx

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
