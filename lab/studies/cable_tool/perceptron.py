"""A perceptron that learns a signal from rows of a log."""

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor, nn

STEPS = 1000
BATCH = 256
LEARNING_RATE = 3.0e-3
WEIGHT_DECAY = 0.1
BLOCK = 100  # Rows that validation takes out together


@dataclass(frozen=True, kw_only=True)
class Rows:
    """What a network sees and should say at each row of some runs."""

    inputs: Tensor
    wanted: Tensor

    def at(self, chosen: Tensor) -> "Rows":
        """Return some of the rows."""
        return Rows(inputs=self.inputs[chosen], wanted=self.wanted[chosen])


def train(data: Rows, seed: int) -> nn.Module:
    """Return a network after the step with the lowest error on blocks that give no gradients."""
    torch.manual_seed(seed)
    mean, scale = data.inputs.mean(dim=0), data.inputs.std(dim=0) + 1.0e-3
    size = float(data.wanted.std())
    network = nn.Sequential(
        Scaled(mean, scale),
        nn.Linear(len(mean), 64),
        nn.Tanh(),
        nn.Linear(64, 32),
        nn.Tanh(),
        nn.Linear(32, 1),
    )
    blocks = torch.arange(len(data.wanted)) // BLOCK
    held = blocks % 6 == seed % 6
    fit, validation = data.at(~held), data.at(held)
    optimizer = torch.optim.AdamW(network.parameters(), lr=LEARNING_RATE, weight_decay=WEIGHT_DECAY)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimizer, STEPS)
    best, kept = np.inf, network.state_dict()
    for step in range(STEPS):
        batch = fit.at(torch.randint(len(fit.wanted), (BATCH,)))
        loss = torch.mean((network(batch.inputs)[:, 0] - batch.wanted / size) ** 2)
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        schedule.step()
        if step % 50 == 49:
            with torch.no_grad():
                said = size * network(validation.inputs)[:, 0]
                error = float(torch.mean((said - validation.wanted) ** 2))
            if error < best:
                best = error
                kept = {name: value.clone() for name, value in network.state_dict().items()}
    network.load_state_dict(kept)
    return nn.Sequential(network, Scaled(torch.zeros(1), torch.tensor([1.0 / size])))


class Scaled(nn.Module):
    """Numbers about one.

    Args:
        mean: What becomes zero.
        scale: What becomes one.
    """

    def __init__(self, mean: Tensor, scale: Tensor) -> None:
        super().__init__()
        self.register_buffer("mean", mean)
        self.register_buffer("scale", scale)

    def forward(self, x: Tensor) -> Tensor:
        """Return the scaled numbers."""
        return (x - self.mean) / self.scale  # pyright: ignore[reportOperatorIssue]
