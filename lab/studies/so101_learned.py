"""Real SO-101 logs: a network on the motions of ``lab.studies.so101``, ``so101_learned LOGS``.

What the servo does other than it was told is learned by a perceptron from the last 1.5 s of
commands, with the angle or without it. It trains on the same two motions of each joint as the
diagnosis and is tested on the same others. The logs are isaac-sim2real/sage's; they are not part of
this repository.
"""

import argparse
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from torch import Tensor, nn

from lab.studies.so101 import joints, split, training_motions
from tendon_lab.foreign_logs.so101 import read_so101
from tendon_newton.data.recording import Array, Recording
from tendon_train.actuator.samples.windows import nearest_rows

PAST = np.concatenate([np.arange(0.0, 0.201, 0.02), np.arange(0.25, 1.51, 0.05)])
"""How long ago the commands are that the network sees [s]: row by row where it matters most."""
STEPS = 1000
BATCH = 256
LEARNING_RATE = 3.0e-3
WEIGHT_DECAY = 0.1
BLOCK = 100  # Rows that validation takes out of the train motions together: 2 s


@dataclass(frozen=True, kw_only=True)
class Rows:
    """What a network sees and should say at each row of some motions."""

    inputs: Tensor  # Command [rad], then how much it was less at each instant of the past [rad]
    residual: Tensor  # Measured minus commanded angle [rad]

    def without_angle(self) -> "Rows":
        """Return the rows without the command itself: a servo the same at all angles."""
        return Rows(inputs=self.inputs[:, 1:], residual=self.residual)

    @staticmethod
    def of(recordings: Sequence[Recording]) -> "Rows":
        """Gather the rows of some motions."""
        parts = [rows_of(recording) for recording in recordings]
        inputs, residual = (np.concatenate(column) for column in zip(*parts, strict=True))
        return Rows(
            inputs=torch.tensor(inputs, dtype=torch.float32),
            residual=torch.tensor(residual, dtype=torch.float32),
        )

    def at(self, chosen: Tensor) -> "Rows":
        """Return some of the rows."""
        return Rows(inputs=self.inputs[chosen], residual=self.residual[chosen])


def rows_of(recording: Recording) -> tuple[Array, Array]:
    """Return inputs, shape (T, P), and residuals [rad], shape (T,), of a motion at rest before."""
    assert recording.command is not None
    command = recording.command[:, 0]
    past = command[nearest_rows(recording.time, recording.time[:, None] - PAST[None, :])]
    inputs = np.column_stack([command, command[:, None] - past[:, 1:]])
    return inputs, recording.motor_position[:, 0] - command


def train(data: Rows, seed: int) -> nn.Module:
    """Return a network after the step with the lowest error on blocks that give no gradients."""
    torch.manual_seed(seed)
    mean, scale = data.inputs.mean(dim=0), data.inputs.std(dim=0) + 1.0e-3
    size = float(data.residual.std())
    network = nn.Sequential(
        Scaled(mean, scale),
        nn.Linear(len(mean), 64),
        nn.Tanh(),
        nn.Linear(64, 32),
        nn.Tanh(),
        nn.Linear(32, 1),
    )
    blocks = torch.arange(len(data.residual)) // BLOCK
    held = blocks % 6 == seed % 6
    fit, validation = data.at(~held), data.at(held)
    optimizer = torch.optim.AdamW(network.parameters(), lr=LEARNING_RATE, weight_decay=WEIGHT_DECAY)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimizer, STEPS)
    best, kept = np.inf, network.state_dict()
    for step in range(STEPS):
        batch = fit.at(torch.randint(len(fit.residual), (BATCH,)))
        loss = torch.mean((network(batch.inputs)[:, 0] - batch.residual / size) ** 2)
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        schedule.step()
        if step % 50 == 49:
            with torch.no_grad():
                said = size * network(validation.inputs)[:, 0]
                error = float(torch.mean((said - validation.residual) ** 2))
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


def main() -> None:
    """Train a network per joint and seed; print what is left on motions that none has seen."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("logs", type=Path)
    parser.add_argument("--joint", action="append", help="joints: all by default")
    parser.add_argument("--train", help="two motions in place of each joint's own, a,b")
    parser.add_argument("--seeds", type=int, nargs="+", default=[0, 1, 2])
    arguments = parser.parse_args()
    torch.set_num_threads(1)
    imported = read_so101(arguments.logs)
    print("held-out RMS error [mrad]: told; with a network that sees the angle; that does not")
    for joint in arguments.joint or joints(imported):
        logs = [log for log in imported.logs if log.conditions["joint"] == joint]
        names = tuple(arguments.train.split(",")) if arguments.train else training_motions(logs)
        with tempfile.TemporaryDirectory() as folder:
            data = split(Path(folder), logs, names)
        seen, held = Rows.of(data.train), Rows.of(data.test)
        told = 1e3 * float(held.residual.square().mean().sqrt())
        cells = [
            errors_of(fit, test, arguments.seeds)
            for fit, test in ((seen, held), (seen.without_angle(), held.without_angle()))
        ]
        print(f"{joint:12s} {told:6.1f}   " + "   ".join(cells), flush=True)


def errors_of(fit: Rows, test: Rows, seeds: Sequence[int]) -> str:
    """Return the mean error over some seeds [mrad] and each one's, in words."""
    errors = [1e3 * error_of(train(fit, seed), test) for seed in seeds]
    return f"{np.mean(errors):6.1f} ({' '.join(f'{error:.1f}' for error in errors)})"


def error_of(network: nn.Module, data: Rows) -> float:
    """Return the RMS error [rad]."""
    with torch.no_grad():
        return float(torch.mean((network(data.inputs)[:, 0] - data.residual) ** 2).sqrt())


if __name__ == "__main__":
    main()
