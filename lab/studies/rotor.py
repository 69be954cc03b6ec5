"""What a physical servo leaves of the force on virtual benches.

``python -m lab.studies.rotor DATASETS``

The servo of the data sheet with a rotor, gear friction and a string that gives is refitted to each
dataset's train recordings. The held-out recordings then say how much force it leaves. A dataset is
what ``tendon-newton collect --plan quick --port virtual::UNIT --faster-than-real-time`` records.
"""

import argparse
from pathlib import Path

import numpy as np

from tendon_lab.reproduction.physical import refit, starting_model
from tendon_newton.data.dataset import Dataset, load_dataset
from tendon_newton.data.model_file import Model, NamedValues
from tendon_newton.data.root_mean_square import rms
from tendon_newton.simulation.hosts.replay import replay

EFFECTS = {
    "coulomb_friction": {"force": 0.5},
    "load_dependent_friction": {"coefficient": 0.4},
    "tendon_compliance": {"stiffness": 1.0e4},
}
"""Causes that every unit has, and where their fits begin."""


def physical_model() -> Model:
    """Return the data sheet's servo with the causes, all to be fitted."""
    start = starting_model()
    effects = tuple(NamedValues(name=name, values=values) for name, values in EFFECTS.items())
    return Model(actuator=start.actuator, effects=effects, fit=start.fit)


def force_left(dataset: Dataset, model: Model) -> float:
    """Return the RMS error of the held-out force [N]."""
    runs = replay(dataset.test, model, time_step=5.0e-4)
    errors = [
        recording.force - run.force
        for recording, run in zip(dataset.test, runs, strict=True)
        if recording.force is not None
    ]
    return rms(np.concatenate(errors))


def main() -> None:
    """Print a row for each dataset."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("datasets", type=Path, nargs="+")
    for folder in parser.parse_args().datasets:
        dataset = load_dataset(folder)
        model = refit(dataset, physical_model())
        numbers = {"torque_constant": model.actuator.values["torque_constant"]}
        numbers["resistance"] = model.actuator.values["resistance"]
        for effect in model.effects:
            numbers |= {f"{effect.name}.{key}": value for key, value in effect.values.items()}
        words = ", ".join(f"{name} {float(value):.4g}" for name, value in numbers.items())
        print(f"{folder.name}: {force_left(dataset, model):.3f} N held out; {words}", flush=True)


if __name__ == "__main__":
    main()
