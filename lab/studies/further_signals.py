"""What further signals tell beside angle and force: ``python -m lab.studies.further_signals``.

Planted sets come from a plant that shares no code with the simulator. Each is diagnosed with one
further signal hidden and with it compared; where its sensor is named, also with the sensor said
to be right.
"""

import argparse
import json
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from tendon_newton.data.dataset import Dataset, load_dataset
from tendon_newton.data.model_file import Model, load_model
from tendon_newton.data.recording import Recording
from tendon_newton.device_code.quiet import quiet_warp
from tendon_newton.diagnosis.diagnose import diagnose
from tendon_newton.effects import EFFECTS
from tests.planted.generator import Recipe, make_dataset
from tests.planted.trials import SERVO

DURATION = (4.0, 5.0)  # Length of each recording [s]
OF_SENSORS = {name for name, effect in EFFECTS.items() if effect.further_signals()}
FIELDS = ("joint_position", "tip", "current", "voltage")


@dataclass(frozen=True, kw_only=True)
class Case:
    """A planted set, and the signal that is hidden and compared."""

    signal: str  # One of `FIELDS`
    mix: str  # Key of `tests.planted.recordings.MIXES`
    effects: tuple[str, ...]
    options: dict[str, Any] = field(default_factory=dict[str, Any])  # Of the recipe
    fit: tuple[str, ...] = ()  # Numbers of the actuator that are not known

    def recipe(self, seed: int) -> Recipe:
        """Return the recipe of the set's data."""
        on_joint = self.signal == "joint_position"
        return Recipe(effects=self.effects, seed=seed, mix=self.mix, duration=DURATION,
                      on_joint=on_joint, **self.options)  # fmt: skip


NO_CELL = {"without_force": True}
MOTOR = {"servo": SERVO}
SUPPLY = {"supply": 7.4}  # [V]
ALIKE = (
    ("gain_error",),
    ("tendon_slack",),
    ("spool_radius_error", "gain_error"),
    ("joint_stiffness_error", "gain_error"),
    ("tendon_compliance", "joint_stiffness_error"),
)
"""Causes that are easily taken for each other, or for others, where no load cell is."""
OF_A_MOTOR = (
    ("gain_error",),
    ("voltage_sag",),
    ("joint_stiffness_error",),
    ("spool_radius_error",),
)
"""The same where the motor's torque constant is not known."""
OF_A_SUPPLY = (
    ("voltage_sag",),
    ("force_saturation",),
    ("torque_fade",),
    ("spring_stiffening",),
    ("voltage_sag", "gain_error"),
    ("voltage_sag", "joint_stiffness_error"),
    ("voltage_sag", "torque_fade", "spring_stiffening"),
)
"""Causes by which large forces fall short, alone and beside those of the same size."""
UNKNOWN = ("torque_constant",)
CASES = (
    *(Case(signal="joint_position", mix="W", effects=own, options=NO_CELL) for own in ALIKE),
    Case(signal="joint_position", mix="W", effects=("joint_encoder_gain",)),
    *(Case(signal="current", mix="W", effects=own, options=MOTOR | NO_CELL, fit=UNKNOWN)
      for own in OF_A_MOTOR),
    Case(signal="current", mix="W", effects=("current_sensor_gain",), options=MOTOR),
    *(Case(signal="voltage", mix="W", effects=own, options=SUPPLY | NO_CELL)
      for own in OF_A_SUPPLY),
    Case(signal="voltage", mix="W", effects=("voltage_sensor_sag",), options=SUPPLY),
    *(Case(signal="tip", mix="F", effects=own, options=NO_CELL) for own in ALIKE),
    Case(signal="tip", mix="F", effects=("tip_sensor_gain",)),
)  # fmt: skip


def seen(dataset: Dataset, signal: str | None) -> Dataset:
    """Return a dataset with angle, force, and at most one further signal."""
    hidden = {name: None for name in FIELDS if name != signal}

    def less(recordings: Sequence[Recording]) -> tuple[Recording, ...]:
        return tuple(replace(recording, **hidden) for recording in recordings)

    return replace(dataset, train=less(dataset.train), test=less(dataset.test))


def answer(dataset: Dataset, model: Model) -> dict[str, Any]:
    """Return names with those of their classes, the verdict and the seconds of a diagnosis."""
    found, _ = diagnose(dataset, model, progress=lambda _: None)
    return {
        "named": {effect.name: list(effect.indistinguishable_from) for effect in found.effects},
        "verdict": found.verdict,
        "seconds": round(found.wall_time_s),
    }


def main() -> None:
    """Plant, diagnose, and print a line for each set."""
    parser = argparse.ArgumentParser(description="What further signals tell.")
    parser.add_argument("--seeds", type=int, nargs="+", default=(2,))
    parser.add_argument("--sets", type=int, nargs="+", default=range(len(CASES)))
    asked = parser.parse_args()
    quiet_warp()
    for seed in asked.seeds:
        for case in (CASES[place] for place in asked.sets):
            with tempfile.TemporaryDirectory() as folder:
                truth = make_dataset(Path(folder), case.recipe(seed))
                dataset = load_dataset(folder)
                model = replace(load_model(Path(folder) / "model.toml"), fit=case.fit)
                line: dict[str, Any] = {
                    "planted": case.effects, "numbers": truth.parameters, "signal": case.signal,
                    "mix": case.mix, "seed": seed, "fit": case.fit,
                    "cell": "without_force" not in case.options,
                    "hidden": answer(seen(dataset, None), model),
                    "compared": answer(seen(dataset, case.signal), model),
                }  # fmt: skip
                if not OF_SENSORS.isdisjoint(line["compared"]["named"]):
                    right = replace(model, tolerances=dict.fromkeys(OF_SENSORS, 0.0))
                    line["trusted"] = answer(seen(dataset, case.signal), right)
            print(json.dumps(line), flush=True)


if __name__ == "__main__":
    main()
