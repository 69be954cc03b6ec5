"""Networks that see what other simulators' drives show them: position error, angle, speed.

Drives of Newton, Isaac Lab and mjlab show a network the error of a joint and its speed, now and at
some steps before (MLP) or step by step (LSTM). Newton's GRU sees command and angle apart, as force
networks of this project do. A Transformer has no place there at all. A student of each kind
therefore learns the force of the identified model, on commands of its own.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from tendon_newton.data.excitations import LARGEST_COMMAND, ramps, random_steps, sine
from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Array
from tendon_newton.effects import find_effect
from tendon_newton.exports.departure import asked_of, command_range
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.simulation.hosts.replay import rollout_of
from tendon_newton.simulation.model.parameter_table import spool_radius_of

RATE = 200.0  # How often a student is asked [Hz]: the usual step of a simulation on Isaac Lab
HISTORY = 16  # Samples that an MLP sees: 80 ms
WIDTHS = (32, 32)  # Units of its hidden layers
MEMORY = 24  # Size of an LSTM and of a GRU
SPAN = 6.0  # Length of a run [s]
TRAIN, HELD_OUT = 9, 3  # Runs that are learned, and runs that only tell the error
PIECE = 100  # Samples of a piece of a run through which a memory learns
LEARNING_RATE = 3.0e-3


@dataclass(frozen=True, kw_only=True)
class Lessons:
    """What a model's servo was asked and did."""

    error: Array  # Command less angle [rad], shape (R, T)
    rate: Array  # Speed [rad/s], shape (R, T)
    force: Array  # [N], shape (R, T); the last `HELD_OUT` runs are not learned
    angle: Array  # Motor angle [rad], shape (R, T)

    @property
    def columns(self) -> Array:
        """Return command [rad], angle [rad] and speed [rad/s], shape (R, T, 3)."""
        return np.stack([self.error + self.angle, self.angle, self.rate], axis=2)

    @property
    def spread(self) -> tuple[Array, Array]:
        """Return mean and standard deviation of the columns and then the force, shape (4,)."""
        known = np.concatenate([self.columns, self.force[..., None]], axis=2)[:-HELD_OUT]
        return known.mean(axis=(0, 1)), np.maximum(known.std(axis=(0, 1)), 1.0e-6)

    @property
    def scales(self) -> tuple[float, float, float]:
        """Return 1 over the spread of errors and of speeds, and the spread of forces."""
        known = slice(None, -HELD_OUT)
        error, rate, force = (
            max(float(x[known].std()), 1.0e-6) for x in (self.error, self.rate, self.force)
        )
        return 1.0 / error, 1.0 / rate, force


class StudentMlp(nn.Module):
    """Layers over scaled errors, newest first, then speeds."""

    def __init__(self) -> None:
        super().__init__()
        sizes = (2 * HISTORY, *WIDTHS)
        layers: list[nn.Module] = []
        for before, after in pairwise(sizes):
            layers += [nn.Linear(before, after), nn.Tanh()]
        self.layers = nn.Sequential(*layers, nn.Linear(sizes[-1], 1))

    def forward(self, x: Tensor) -> Tensor:
        """Return scaled forces, shape (N, 1), of inputs of shape (N, 2 H)."""
        return self.layers(x)


class StudentMemory(nn.Module):
    """A memory over scaled signals; its state is a tensor of shape (1, N, M), of an LSTM two."""

    def __init__(self, memory: nn.LSTM | nn.GRU) -> None:
        super().__init__()
        self.memory = memory
        self.head = nn.Linear(MEMORY, 1)

    def forward(self, x: Tensor, state: Any) -> tuple[Tensor, Any]:
        """Return scaled forces, shape (N, T, 1), and the new state."""
        out, state = self.memory(x, state)
        return self.head(out), state


def lessons_of(mechanism: Mechanism, model: Model) -> Lessons:
    """Simulate a model under commands from which its servo can be learned.

    What a load cell adds is left out: a simulator wants the force itself.
    """
    servo = Model(
        actuator=model.actuator,
        effects=tuple(e for e in model.effects if not find_effect(e.name).acts_on_cell_only()),
        bench_overrides=model.bench_overrides,
    )
    rng = np.random.default_rng(0)
    low, high = command_range(mechanism, spool_radius_of(model))
    time = np.arange(round(SPAN * RATE)) / RATE
    kinds = (random_steps, sine, ramps)
    runs = []
    for number in range(TRAIN + HELD_OUT):
        share = kinds[number % len(kinds)](time, rng) / LARGEST_COMMAND
        runs.append(asked_of(mechanism, f"lesson {number}", time, low + (high - low) * share))
    rollout = rollout_of(mechanism, runs, servo)
    found = rollout.run(rollout.base_vectors(servo)[None])[0]
    asked = np.array([run.command[:, 0] for run in runs if run.command is not None])
    angle = np.array([trajectory.motor_position[:, 0] for trajectory in found])
    return Lessons(
        error=asked - angle,
        rate=np.array([trajectory.motor_velocity[:, 0] for trajectory in found]),
        force=np.array([trajectory.force[:, 0] for trajectory in found]),
        angle=angle,
    )


def windows_of(lessons: Lessons) -> tuple[Tensor, Tensor]:
    """Return an MLP's scaled inputs, shape (R, T, 2 H), and forces, shape (R, T)."""
    error_scale, rate_scale, force_scale = lessons.scales
    columns = []
    for signal, scale in ((lessons.error, error_scale), (lessons.rate, rate_scale)):
        for age in range(HISTORY):
            past = np.concatenate([np.repeat(signal[:, :1], age, axis=1), signal], axis=1)
            columns.append(scale * past[:, : signal.shape[1]])
    x = torch.tensor(np.stack(columns, axis=2), dtype=torch.float32)
    return x, torch.tensor(lessons.force / force_scale, dtype=torch.float32)


def fit_mlp(lessons: Lessons, *, steps: int) -> tuple[StudentMlp, float]:
    """Fit an MLP and return it with its root mean square error [N] on runs it has not seen."""
    torch.manual_seed(0)
    network = StudentMlp()
    x, force = windows_of(lessons)
    known, asked = x[:-HELD_OUT].flatten(0, 1), force[:-HELD_OUT].flatten()
    descend(network, lambda: ((network(known)[:, 0] - asked) ** 2).mean(), steps)
    with torch.no_grad():
        away = network(x[-HELD_OUT:])[..., 0] - force[-HELD_OUT:]
    return network.eval(), float((away**2).mean().sqrt()) * lessons.scales[2]


def descend(network: nn.Module, loss: Callable[[], Tensor], steps: int) -> None:
    """Lower a network's loss by Adam, whose rate goes down along a cosine."""
    rule = torch.optim.Adam(network.parameters(), lr=LEARNING_RATE)
    pace = torch.optim.lr_scheduler.CosineAnnealingLR(rule, steps)
    for _ in range(steps):
        rule.zero_grad()
        loss().backward()
        rule.step()
        pace.step()


def fit_lstm(lessons: Lessons, *, steps: int) -> tuple[StudentMemory, float]:
    """Fit an LSTM and return it with its root mean square error [N] on runs it has not seen."""
    torch.manual_seed(0)
    network = StudentMemory(nn.LSTM(2, MEMORY, batch_first=True))  # errors and speeds
    x, force = windows_of(lessons)
    error = fit_memory(network, x[..., [0, HISTORY]], force, lambda n: (blank(n), blank(n)), steps)
    return network.eval(), error * lessons.scales[2]


def fit_gru(lessons: Lessons, *, steps: int) -> tuple[StudentMemory, float]:
    """Fit a GRU and return it with its root mean square error [N] on runs it has not seen."""
    torch.manual_seed(0)
    network = StudentMemory(nn.GRU(3, MEMORY, batch_first=True))  # commands, angles and speeds
    (*means, middle), (*widths, wide) = lessons.spread
    x = torch.tensor((lessons.columns - means) / widths, dtype=torch.float32)
    force = torch.tensor((lessons.force - middle) / wide, dtype=torch.float32)
    error = fit_memory(network, x, force, blank, steps)
    return network.eval(), error * float(wide)


def blank(count: int) -> Tensor:
    """Return the state of memories that have seen nothing, shape (1, N, M)."""
    return torch.zeros(1, count, MEMORY)


def fit_memory(
    network: nn.Module, x: Tensor, force: Tensor, start: Callable[[int], Any], steps: int
) -> float:
    """Fit a network with a memory; return its root mean square error on runs it has not seen.

    The network maps scaled inputs (N, T, C) and a state to scaled forces (N, T, 1) and a state;
    `start` makes a state that has seen nothing for a count N.
    """
    pieces = x[:-HELD_OUT].reshape(-1, PIECE, x.shape[2])
    asked = force[:-HELD_OUT].reshape(-1, PIECE)
    skip = PIECE // 4  # a state from nothing knows little of what was before

    def loss() -> Tensor:
        answer, _ = network(pieces, start(len(pieces)))
        return ((answer[:, skip:, 0] - asked[:, skip:]) ** 2).mean()

    descend(network, loss, steps)
    with torch.no_grad():
        answer, _ = network(x[-HELD_OUT:], start(HELD_OUT))
    away = answer[..., 0] - force[-HELD_OUT:]
    return float((away**2).mean().sqrt())
