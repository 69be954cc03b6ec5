"""Physics and a network: the network learns what the diagnosed servo leaves of the force."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import torch
from torch import Tensor, nn

from tendon_newton.actuators.networks.artifact import write_network
from tendon_newton.effects import find_effect
from tendon_newton.force_network_card import HoldLaw
from tendon_newton.model_file import Model, NamedValues
from train.actuator.export import make_card
from train.actuator.force_data import prepare
from train.actuator.prediction import ask
from train.actuator.training import train_network
from train.reproduction.servo_force import missing_force, servo_of

if TYPE_CHECKING:
    from tendon_newton.dataset import Dataset
    from tendon_newton.recording import Recording
    from train.actuator.training_config import TrainingConfig
    from train.actuator.windows import Windows


JUMPS = 0.05
"""Share of the rows whose missing force is cut: a late load cell must not decide."""


class CorrectedSource(nn.Module):
    r"""An ideal source and what a network adds to it.

    .. math:: F = P (\theta_d - \theta) + \sigma f(o_{k-H+1}, \dots, o_k)

    Args:
        correction: Maps windows of servo signals, shape (W, H, 3), to forces [N], shape (W,).
        gain: P [N/rad].
        share: How much of the correction is added [1].
    """

    def __init__(self, correction: Any, *, gain: float, share: float) -> None:
        super().__init__()
        self.correction = correction
        self.gain: float = gain
        self.share: float = share

    def forward(self, window: Tensor) -> Tensor:
        """Return the force [N], shape (W,)."""
        return self.source(window) + self.share * self.correction(window)

    @torch.jit.export
    def last_query(self, window: Tensor) -> Tensor:
        """Return the force [N], shape (W,), with no more than the last sample needs."""
        return self.source(window) + self.share * self.correction.last_query(window)

    def source(self, window: Tensor) -> Tensor:
        """Return the ideal source's force at the end of each window [N], shape (W,)."""
        return self.gain * (window[:, -1, 0] - window[:, -1, 1])


def train_hybrid(dataset: Dataset, physical: Model, config: TrainingConfig, out: Path) -> Model:
    """Train a network on what a physical model's servo lacks, and return the model of both.

    The frictions of the servo and all that lies behind the load cell stay effects of the model:
    they act at every step of a simulation, and so does the gain, where a network's correction is
    held between queries. Of the correction as much is added as the validation recordings bear out.

    Args:
        dataset: Recordings to learn from.
        physical: The diagnosed model.
        config: How the network is trained; its kind must be a Transformer.
        out: Folder for the network's files.
    """
    torch.set_num_threads(config.threads)
    servo = servo_of(physical)
    data = prepare(dataset, config)
    fit = with_missing_forces(data.fit, data.fold.fit, servo)
    validation = with_missing_forces(data.validation, data.fold.validation, servo)
    path = out / f"hybrid-{config.name}.pt"
    network, _ = train_network(config, fit, validation, path.with_suffix(".checkpoint"))
    source = CorrectedSource(
        network, gain=float(servo.actuator.values["gain"]), share=share_of(network, validation)
    )
    card = make_card(network, config, dataset, data)
    write_network(path, source, replace(card, hold=HoldLaw(stiffness=source.gain)))
    return hybrid_model(path, physical, servo)


def with_missing_forces(windows: Windows, recordings: Sequence[Recording], servo: Model) -> Windows:
    """Return windows whose force is what a servo's model lacks, its jumps cut."""
    force = np.concatenate([missing_force(recording, servo) for recording in recordings])
    limit = float(np.quantile(np.abs(force), 1.0 - JUMPS))
    return replace(windows, force=np.clip(force, -limit, limit))


def share_of(network: nn.Module, validation: Windows) -> float:
    """Return the share of a network's force, 0 to 1, that leaves least of the validation forces."""
    said, wanted = ask(network, validation), validation.force[validation.last]
    return float(np.clip(said @ wanted / max(float(said @ said), 1.0e-12), 0.0, 1.0))


def hybrid_model(network: Path, physical: Model, servo: Model) -> Model:
    """Return the model in which a corrected source takes the place of the physical one."""
    values = {
        "file": str(network.resolve()), "spool_radius": servo.actuator.values["spool_radius"]
    }  # fmt: skip
    behind = tuple(e for e in physical.effects if find_effect(e.name).side != "actuator")
    return replace(
        physical,
        actuator=NamedValues(name="learned", values=values),
        effects=(*servo.effects, *behind),
        fit=(),
    )
