"""The networks of a bench or of a part of its recordings, trained and written as models."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any, Literal

from tendon_newton.data.model_file import Model, NamedValues, write_model
from train.actuator.fitting.run import train_to_file
from train.actuator.training_config import Kind, Purpose
from train.reproduction.correction import train_correction
from train.reproduction.physical import SPOOL_RADIUS
from train.reproduction.reproduction import Reproduction
from train.reproduction.training_anew import anew_if_other
from train.reproduction.unit import Unit

Aim = Literal["prediction", "simulation", "correction"]
"""What a network is for: the force along measured motion, in the loop of a simulation, or what a
servo with friction lacks there."""
IN_LOOP: Purpose = "simulation"


def train(reproduction: Reproduction, unit: Unit, kind: Kind, aim: Aim) -> dict[str, Any]:
    """Train a network, write its model where a simulation is its aim, and return its numbers.

    Args:
        reproduction: It has the settings.
        unit: A bench, or a part of its recordings.
        kind: Of the network.
        aim: What it is for.
    """
    folder = reproduction.folder("networks", unit.name)
    config = reproduction.settings.training(kind, "prediction" if aim == "prediction" else IN_LOOP)
    if aim == "correction":
        reproduction.tell(f"  {unit.name}: {config.name} on what a servo with friction lacks")
        made = train_correction(unit.dataset, config, folder, tell=reproduction.tell)
        write_model(reproduction.model_file(unit, "servo"), made.model)
        return {**asdict(made.servo), "share": made.share, "bound_n": made.bound}
    reproduction.tell(f"  {unit.name}: {config.name}")
    exported = anew_if_other(
        folder / f"{config.name}.checkpoint",
        lambda: train_to_file(unit.dataset, config, folder, report=lambda progress: None),
        reproduction.tell,
    )
    assert exported is not None
    if aim == IN_LOOP:
        model = learned_model(exported.torchscript)
        write_model(reproduction.model_file(unit, "network"), model)
    held_out = exported.card.held_out
    return {} if held_out is None else {"test_force_rmse_n": held_out.force_rmse}


def learned_model(network: Path) -> Model:
    """Return the model in which a network pulls the nominal mechanism, as in the paper."""
    values = {"file": str(network.resolve()), "spool_radius": SPOOL_RADIUS}
    return Model(actuator=NamedValues(name="learned", values=values))
