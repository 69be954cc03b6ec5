"""Held out stays held out in the verbs of the lab: ``python -m lab.tests.held_out``."""

import json
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from tendon_lab.exam.run_exam import QUESTION
from tendon_lab.reproduction.physical import starting_model
from tendon_newton.data.dataset import load_dataset, write_dataset
from tendon_newton.data.model_file import NamedValues, write_model
from tests.held_out import (
    Made,
    diagnosed,
    main,
    noise_like,
    said,
    servo_dataset,
    small_dataset,
    weights_of,
)


def exam(folder: Path, noisy: bool) -> Made:
    """The answer to one question; only its mark is the report."""
    small_dataset(folder / "exam" / "one", noisy)
    (folder / "exam" / "truth").mkdir()
    effect = {"name": "viscous_friction", "parameters": {"coefficient": 0.8}}
    truth = {"id": "one", "family": "single", "effects": [effect]}
    (folder / "exam" / "truth" / "one.json").write_text(json.dumps(truth))
    said(["exam", folder / "exam", "--out", folder / "out", "--jobs", "1"])
    answer = json.loads((folder / "out" / "one" / "diagnosis.json").read_text())
    del answer[QUESTION]  # tells one question from another, and decides nothing
    return diagnosed(answer, folder / "out" / "one" / "model.toml")


def evaluate_force(folder: Path, noisy: bool) -> Made:
    """Nothing is fitted but the gain of the ideal source that a network has to beat."""
    from tendon_lab.force_scoring.compared_models import compare

    data = load_dataset(servo_dataset(folder, noisy))
    models = {model.name: model for model in compare([], data, data.test)}
    errors = [p.error.tolist() for p in models["ideal refitted"].predictions]
    return Made(decided={name: m.gain for name, m in models.items()}, reported=errors)


def reproduce(folder: Path, noisy: bool) -> Made:
    """Every model of a bench: physics by refit, networks, servo, and both together.

    Commands stay, since test recordings are told apart by them.
    """
    from lab.tests.reproduction.tiny import SETTINGS, TinyBench
    from tendon_lab.reproduction.reproduction import Reproduction
    from tendon_lab.reproduction.steps.stage_list import run_stages
    from tendon_lab.reproduction.unit import EXPERIMENTS, RECORDINGS
    from tendon_newton.scheduler import InTurn

    TinyBench().record(0, folder / "recorded", seed=0, most=None)
    for part in (RECORDINGS, EXPERIMENTS):
        data = load_dataset(folder / "recorded" / part, require_train=False)
        test = [replace(noise_like(r), command=r.command) if noisy else r for r in data.test]
        write_dataset(folder / "bench" / part, data.train, test)
    friction = NamedValues(name="load_dependent_friction", values={"coefficient": 0.2})
    write_model(folder / "causes.toml", replace(starting_model(), effects=(friction,)))
    whole = Reproduction(
        settings=SETTINGS,
        out=folder,
        folders=(folder / "bench",),
        causes=folder / "causes.toml",
        executor=InTurn(),
    )
    found = run_stages(whole, ("tip",))
    models = {
        file.relative_to(folder).as_posix(): file.read_text().replace(str(folder), "")
        for file in sorted((folder / "models").rglob("*.toml"))
    }
    assert len(models) >= 3
    models |= {file.name: weights_of(file) for file in sorted(folder.rglob("*.checkpoint"))}
    return Made(decided=models, reported=found["tip"].numbers)


def import_logs(folder: Path, noisy: bool) -> Made:
    """The model to start from, and every train recording; the log of the test split says more."""
    from tests.importers.logs import xl330_log

    for kp, supply in ((100, 7.0), (200, 7.4), (800, 7.6)):
        xl330_log(folder / "logs" / f"kp{kp}_sine.json", kp=kp, vin=supply)
    if noisy:
        path = folder / "logs" / "kp200_sine.json"
        table, rng = json.loads(path.read_text()), np.random.default_rng(1)
        for entry in table["entries"]:
            noise = rng.standard_normal(4)
            entry |= dict(zip(("position", "speed", "load", "goal_position"), noise, strict=True))
            entry["input_volts"] = 5.0 + 0.1 * float(noise[0])
        path.write_text(json.dumps(table | {"vin": 5.0, "mass": 0.3}))
    words = ["xl330", folder / "logs", "--out", folder / "out", "--test", "kp=200"]
    text = said(["import", *words])
    made = {r.name: r.motor_position.tolist() for r in load_dataset(folder / "out").train}
    made["model.toml"] = (folder / "out" / "model.toml").read_text()
    return Made(decided=made, reported=text)


CASES: dict[str, Callable[[Path, bool], Made]] = {
    "import": import_logs,
    "exam": exam,
    "evaluate-force": evaluate_force,
    "reproduce": reproduce,
}

if __name__ == "__main__":
    sys.exit(main(CASES, "python -m lab.tests.held_out"))
