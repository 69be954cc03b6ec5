"""An MLP that sees what drives of Isaac Lab and mjlab show it: errors and speeds.

Such a drive shows a network the error of a joint and its speed, now and at some steps before. A
force network has no place there, so an MLP learns its force on commands of its own.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from tendon_newton.data.excitations import LARGEST_COMMAND, ramps, random_steps, sine
from tendon_newton.data.files.text_file import write_bytes
from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Array
from tendon_newton.effects import find_effect
from tendon_newton.exports.departure import asked_of, command_range
from tendon_newton.mechanisms.geometry.mechanism import Mechanism
from tendon_newton.simulation.hosts.replay import rollout_of
from tendon_newton.simulation.model.parameter_table import spool_radius_of

RATE = 200.0  # How often it is asked [Hz]: the usual step of a simulation on Isaac Lab
HISTORY = 16  # Samples that it sees: 80 ms
WIDTHS = (32, 32)  # Units of its hidden layers
SPAN = 6.0  # Length of a run [s]
TRAIN, HELD_OUT = 9, 3  # Runs that are learned, and runs that only tell the error
LEARNING_RATE = 3.0e-3

# What errors and speeds are multiplied by, and then the network's answer
Scales = tuple[float, float, float]


@dataclass(frozen=True, kw_only=True)
class Lessons:
    """What a model's servo was asked and did."""

    error: Array  # Command less angle [rad], shape (R, T)
    rate: Array  # Speed [rad/s], shape (R, T)
    force: Array  # [N], shape (R, T); the last `HELD_OUT` runs are not learned

    @property
    def scales(self) -> Scales:
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


def write_torchscript(path: Path, network: nn.Module) -> None:
    """Write a network as TorchScript.

    Raises:
        InvalidOutput: The file cannot be written.
    """
    import warnings

    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", category=DeprecationWarning)
        scripted: Any = torch.jit.script(network.eval())
        write_bytes(path, scripted.save_to_buffer())
