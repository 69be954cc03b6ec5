"""Physics and a network together, on every bench."""

from __future__ import annotations

from tendon_newton.model_file import write_model
from train.reproduction.hybrid import train_hybrid
from train.reproduction.outcome import Outcome
from train.reproduction.reproduction import Reproduction

TEXT = """\
The Transformer learns what the frictions and the gain of the diagnosed servo leave of the measured
force, along the measured motion: nothing where the force lies between what sliding in and sliding
out would give and the motor stands still. Half of its windows depart from that motion, and what it
adds stays. In a simulation this is held between its queries; gain, frictions, back-EMF and all that
lies behind the load cell act at every step."""


def run(reproduction: Reproduction) -> Outcome:
    """Train what is missing."""
    for unit in reproduction.units:
        config = reproduction.settings.training(purpose="simulation")
        reproduction.tell(f"  {unit.name}: {config.name} on what physics leaves")
        model = train_hybrid(
            unit.dataset,
            reproduction.model(unit, "physical"),
            config,
            reproduction.folder("networks", unit.name),
        )
        write_model(reproduction.model_file(unit, "hybrid"), model)
    return Outcome(text=TEXT)
