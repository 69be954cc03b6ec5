"""A servo with friction, and a network that learns what it leaves of the measured force."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from tendon_lab.reproduction.physical import SPOOL_RADIUS
from tendon_lab.reproduction.servo_force import MeasuredServo, missing_force
from tendon_newton.actuators.networks.artifact import write_network
from tendon_newton.data.dataset import Dataset
from tendon_newton.data.model_file import Model, NamedValues
from tendon_newton.data.recording import Array, Recording
from tendon_newton.errors import InvalidDataset
from tendon_train.actuator.fitting.force_export import make_card
from tendon_train.actuator.fitting.training import train_network
from tendon_train.actuator.prediction import ask
from tendon_train.actuator.samples.folds import prepare
from tendon_train.actuator.samples.servo_law import NO_LAW, fit_servo_law
from tendon_train.actuator.samples.windows import Windows
from tendon_train.actuator.training_config import TrainingConfig

JUMPS = 0.05
"""Share of the rows whose missing force is cut: where a command jumps, rotor and load cell are
late, and that must not decide."""


@dataclass(frozen=True, kw_only=True)
class Corrected:
    """A servo and a network, and what they are made of."""

    model: Model  # Both, pulling the nominal mechanism
    servo: MeasuredServo  # The servo without the network
    share: float  # Share of the network's force that is added [1]
    bound: float  # Most that is added [N]


class CorrectedSource(nn.Module):
    r"""A servo without friction and what a network adds to it.

    .. math:: F = P (\theta_d - \theta) - D \dot\theta
        + \operatorname{clip}(\sigma f(o_{k-H+1}, \dots, o_k), \pm b)

    Args:
        correction: Maps windows of servo signals, shape (W, H, 3), to forces [N], shape (W,).
        servo: Servo with P [N/rad] and D [N s/rad].
        share: Share of the correction that is added, sigma [1].
        bound: Most that is added, b [N].
    """

    def __init__(
        self, correction: Any, servo: MeasuredServo, *, share: float, bound: float
    ) -> None:
        super().__init__()
        self.correction = correction
        self.stiffness: float = servo.stiffness
        self.damping: float = servo.damping
        self.share: float = share
        self.bound: float = bound

    def forward(self, window: Tensor) -> Tensor:
        """Return the force [N], shape (W,)."""
        return self.source(window) + self.bounded(self.correction(window))

    @torch.jit.export
    def last_query(self, window: Tensor) -> Tensor:
        """Return the force [N], shape (W,), with no more than the last sample needs."""
        return self.source(window) + self.bounded(self.correction.last_query(window))

    def source(self, window: Tensor) -> Tensor:
        """Return the servo's own force at the end of each window [N], shape (W,)."""
        command, angle, speed = window[:, -1, 0], window[:, -1, 1], window[:, -1, 2]
        return self.stiffness * (command - angle) - self.damping * speed

    def bounded(self, correction: Tensor) -> Tensor:
        """Return what is added [N], shape (W,)."""
        return torch.clamp(self.share * correction, -self.bound, self.bound)


def train_correction(dataset: Dataset, config: TrainingConfig, out: Path) -> Corrected:
    """Train a network on what a servo with friction lacks, and return the model of both.

    Stiffness, back-EMF and friction of the servo are fitted along the measured motion of the train
    recordings, where the force is known. A diagnosed model is no source for them: numbers that were
    fitted in a closed loop stand for each other. The network would have to take their excess away
    again at every reversal. Friction acts at every step of a simulation, and the source answers to
    the shaft between two queries. As much of the correction is added as the validation recordings
    bear out, and hardly ever more than was missing in training.

    Args:
        dataset: Recordings to learn from.
        config: How the network is trained; its kind must be a Transformer.
        out: Folder for the network's files.

    Raises:
        InvalidDataset: Too few rows slide to fit a servo.
        InvalidNetworkFile: The checkpoint is damaged or of another training.
    """
    torch.set_num_threads(config.threads)
    data = prepare(dataset, config)
    servo = MeasuredServo.of(fit_servo_law(data.fit))
    if servo.stiffness <= 0.0:
        raise InvalidDataset(f"{dataset.path}: too few rows slide under load to fit a servo")
    missing, unseen = (
        np.concatenate([lasting_force(recording, servo, config.rate) for recording in part])
        for part in (data.fold.fit, data.fold.validation)
    )
    bound = float(np.quantile(np.abs(missing), 1.0 - JUMPS))
    fit = replace(data.fit, force=np.clip(missing, -bound, bound))
    validation = replace(data.validation, force=np.clip(unseen, -bound, bound))
    path = out / f"hybrid-{config.name}.pt"
    checkpoint = path.with_suffix(".checkpoint")
    network, _ = train_network(config, fit, validation, checkpoint, law=NO_LAW)
    share = share_of(network, validation)
    card = replace(make_card(network, config, dataset, data), hold=servo.hold)
    write_network(path, CorrectedSource(network, servo, share=share, bound=bound), card)
    values = {"file": str(path.resolve()), "spool_radius": SPOOL_RADIUS}
    model = Model(actuator=NamedValues(name="learned", values=values), effects=servo.frictions)
    return Corrected(model=model, servo=servo, share=share, bound=bound)


def lasting_force(recording: Recording, servo: MeasuredServo, rate: float) -> Array:
    """Return what a servo lacks when the answer to a row's query has been held [N], shape (T,).

    The row is the last one before a network would be asked again, or before the command changes.
    Right after a change rotor and load cell are late, and the whole command seems to be missing.
    Held until the next query, that lack would come back at every query, as commands change where
    queries are made.

    Args:
        recording: A recording with one tendon, its command and its tension.
        servo: Known numbers of the servo.
        rate: Queries per second [Hz].
    """
    assert recording.command is not None
    time, command = recording.time, recording.command[:, 0]
    step = float(np.median(np.diff(time)))
    again = np.searchsorted(time, time + 1.0 / rate - 0.5 * step) - 1
    changes = np.append(np.flatnonzero(np.diff(command)), len(time) - 1)
    same = changes[np.searchsorted(changes, np.arange(len(time)))]
    return missing_force(recording, servo)[
        np.maximum(np.minimum(again, same), np.arange(len(time)))
    ]


def share_of(network: nn.Module, validation: Windows) -> float:
    """Return the share of a network's force, 0 to 1, that leaves least of the validation forces."""
    said, wanted = ask(network, validation), validation.force[validation.last]
    return float(np.clip(said @ wanted / max(float(said @ said), 1.0e-12), 0.0, 1.0))
