"""Force networks of every bench."""

from __future__ import annotations

from pathlib import Path

from tendon_newton.model_file import Model, NamedValues, write_model
from train.actuator.run import train_to_file
from train.reproduction.outcome import Outcome
from train.reproduction.physical import SPOOL_RADIUS
from train.reproduction.reproduction import Reproduction


def run(reproduction: Reproduction) -> Outcome:
    """Train what is missing: every kind on the first bench, one kind on the others.

    The first kind is trained twice, along measured motion and for the loop of a simulation.
    """
    errors: dict[str, float] = {}
    settings = reproduction.settings
    in_loop = settings.training(purpose="simulation")
    for place, unit in enumerate(reproduction.units):
        kinds = settings.kinds[: None if place == 0 else 1]
        for config in (*map(settings.training, kinds), in_loop):
            reproduction.tell(f"  {unit.name}: {config.name}")
            exported = train_to_file(
                unit.dataset, config, reproduction.folder("networks", unit.name),
                report=lambda progress: None,
            )  # fmt: skip
            assert exported is not None
            if exported.card.held_out is not None:
                errors[f"{unit.name} {config.name}"] = exported.card.held_out.force_rmse
        path = reproduction.folder("networks", unit.name) / f"{in_loop.name}.pt"
        write_model(reproduction.model_file(unit, "network"), learned_model(path))
    return Outcome(numbers={"test_force_rmse_n": errors})


def learned_model(network: Path) -> Model:
    """Return the model in which a network pulls the nominal mechanism, as in the paper."""
    values = {"file": str(network.resolve()), "spool_radius": SPOOL_RADIUS}
    return Model(actuator=NamedValues(name="learned", values=values))
