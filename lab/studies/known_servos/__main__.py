"""The servos that ship: identify them from published logs, and hold them to logs left out.

``python -m lab.studies.known_servos xl330 LOGS`` diagnoses the training logs of a split of the
comparison and writes ``assets/servos/xl330``; with ``--check`` it tests what is there. An answer of
``tendon-newton diagnose`` on the same split is packed with ``--answer``. The logs are
not part of this repository.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from lab.studies.comparison.rows import mean_error, study_of
from lab.studies.comparison.splits import Split, sts3215_splits, xl330_splits
from lab.studies.known_servos.table import SERVOS
from tendon_lab.foreign_logs.bam.motors import STS3215, XL330, BamMotor
from tendon_newton.data.dataset import Dataset
from tendon_newton.data.files.json_file import write_json
from tendon_newton.data.importers.imported import ImportedLog
from tendon_newton.data.model_file import Model, load_model
from tendon_newton.data.recording import Array, Recording
from tendon_newton.diagnosis.known_servos import EVIDENCE, write_servo
from tendon_newton.diagnosis.reporting.report import Origin
from tendon_newton.simulation.hosts.replay import replay
from tendon_newton.workflows.diagnosing import diagnose_into

GRAVITY = 9.81  # [m/s2]
GOALS = (0.0, 1.0, -0.5)  # Steps by which the product's tests know the model again [rad]
RATE, ROWS = 20.0, 16  # Rows a second, and rows of each step


@dataclass(frozen=True, kw_only=True)
class Logs:
    """The logs of a servo that ships."""

    splits: Callable[[Path], list[Split]]
    split: str  # Its training logs are fitted, all others are held out
    servo: str  # Its name in the table of servos
    motor: BamMotor  # Its gain and supply are those of the model
    source: str
    licence: str
    fitted: str
    held_out: str


LOGS: Mapping[str, Logs] = {
    "xl330": Logs(
        splits=xl330_splits,
        split="xl330: test kp 400",
        servo="xl330_m288_t",
        motor=XL330,
        source="Rhoban/bam, branch xl330, commit af22604",
        licence="Apache-2.0",
        fitted="gains 100, 200 and 800",
        held_out="gain 400",
    ),
    "sts3215": Logs(
        splits=sts3215_splits,
        split="sts3215: gains",
        servo="sts3215",
        motor=STS3215,
        source="kscalelabs/sysid, March 2025",
        licence="none stated; the logs are not here",
        fitted="gains 8 and 32",
        held_out="gains 4 and 16",
    ),
}
"""Where each servo that ships comes from."""


def split_of(name: str, folder: Path) -> Split:
    """Return the logs of a servo."""
    return next(split for split in LOGS[name].splits(folder) if split.key == LOGS[name].split)


def identify(split: Split, out: Path) -> None:
    """Diagnose the training logs of a servo."""
    dataset = Dataset(
        path=Path(split.name),
        train=tuple(log.recording for log in split.train),
        test=tuple(log.recording for log in split.test),
    )
    diagnose_into(
        out, dataset, split.start, Origin(), progress=lambda text: print(text, flush=True)
    )


def pack(name: str, split: Split, answer: Path) -> None:
    """Write what ships: an answer with its evidence, at the factory's gain and its logs' supply."""
    own, home = LOGS[name], SERVOS / name
    home.mkdir(parents=True, exist_ok=True)
    write_json(answer / EVIDENCE, evidence(name, split, load_model(answer / "model.toml")))
    write_servo(answer, home, gain=own.motor.gain, supply=own.motor.supply)


def evidence(name: str, split: Split, model: Model) -> dict[str, Any]:
    """Return where a packaged servo comes from, what it leaves, and over which conditions."""
    own, sheet = LOGS[name], model.actuator
    values = {**sheet.values, "duty_per_rad": own.motor.gain * own.motor.duty_per_gain}
    values["supply_voltage"] = own.motor.supply
    model = replace(model, actuator=replace(sheet, values=values))
    logs = (*split.train, *split.test)
    return {
        "servo": own.servo,
        "source": own.source,
        "licence": own.licence,
        "split": own.split,
        "fitted": own.fitted,
        "held_out": own.held_out,
        "logs": [len(split.train), len(split.test)],
        "held_out_mrad": error(split.test, model),
        "fitted_mrad": error(split.train, model),
        "duty_per_gain": own.motor.duty_per_gain,
        "steps": steps(model, split.train[0]),
        "gains": ends([float(log.conditions["kp"]) for log in logs]),
        "load_nm": max(load(log) for log in logs),
        "supply_v": medians([log.recording.voltage for log in logs]),
        "temperature_degc": medians([log.recording.temperature for log in logs]),
    }


def steps(model: Model, log: ImportedLog) -> dict[str, Any]:
    """Return what a model does in some steps under the load of a log."""
    still = np.zeros((ROWS * len(GOALS), 1))
    run = Recording(
        name="steps.csv",
        bench=log.recording.bench,
        time=np.arange(len(still)) / RATE,
        command=np.repeat(GOALS, ROWS)[:, None],
        motor_position=still,
        motor_velocity=still,
        bench_overrides=log.recording.bench_overrides,
        start="first_row",
    )
    (found,) = replay([run], model)
    return {
        "rate_hz": RATE,
        "goal_rad": list(GOALS),
        "mass_kg": log.conditions["mass"],
        "length_m": log.conditions["length"],
        "angle_rad": [round(float(angle), 4) + 0.0 for angle in found.motor_position[:, 0]],
    }


def error(logs: Sequence[ImportedLog], model: Model) -> float:
    """Return the mean absolute error of the angle over logs [mrad]."""
    return round(mean_error(study_of(tuple(logs), model), {}), 2)


def load(log: ImportedLog) -> float:
    """Return the greatest torque of a log's mass about the shaft [N m]."""
    return round(GRAVITY * float(log.conditions["mass"]) * float(log.conditions["length"]), 3)


def medians(columns: Sequence[Array | None]) -> list[float]:
    """Return the least and the greatest median of logs that have a column."""
    return ends([float(np.median(column)) for column in columns if column is not None])


def ends(values: Sequence[float]) -> list[float]:
    """Return the least and the greatest of some values."""
    return [round(min(values), 2), round(max(values), 2)]


def main() -> None:
    """Identify a servo and pack it, or test the one that ships."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("servo", choices=list(LOGS))
    parser.add_argument("logs", type=Path)
    parser.add_argument("--check", action="store_true", help="test what ships instead")
    parser.add_argument(
        "--answer", type=Path, help="folder of a diagnosis; made unless it is there"
    )
    chosen = parser.parse_args()
    split = split_of(chosen.servo, chosen.logs)
    if not chosen.check:
        with tempfile.TemporaryDirectory() as place:
            answer = chosen.answer or Path(place)
            if not (answer / "diagnosis.json").is_file():
                identify(split, answer)
            pack(chosen.servo, split, answer)
    model = load_model(SERVOS / chosen.servo / "model.toml")
    print(json.dumps(evidence(chosen.servo, split, model), indent=1))


if __name__ == "__main__":
    main()
