"""Broken diagnoses are refused in one line that says what is wrong and where."""

import importlib.util
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tendon_newton.diagnosis.diagnosis_file import read_diagnosis
from tendon_newton.diagnosis.posterior import FittedSet, Posterior, write_posterior
from tendon_newton.errors import InvalidDiagnosis
from tests.bad_input.damage import Damage, refusal, text
from tests.importers.logs import model

ANSWER: dict[str, Any] = {
    "schema": 1,
    "wall_time_s": 40.0,
    "verdict": "explained",
    "effects": [
        {
            "name": "viscous_friction",
            "side": "actuator",
            "parameters": {"coefficient": {"value": 1.49, "ci95": [1.4, 1.6], "unit": "N s/rad"}},
            "gain": {"theta_rmse": [0.1, 0.01]},
            "indistinguishable_from": [],
            "separating_experiment": None,
        }
    ],
}
SETS = Posterior(
    sets=tuple(
        FittedSet(weight=0.5, causes=(name,), numbers=(), covariance=np.zeros((0, 0)))
        for name in ("viscous_friction", "load_dependent_friction")
    )
)
OPEN: dict[str, Any] = {
    **ANSWER,
    "noise_floor": {"force": 0.05, "theta": 0.0009},
    "recorded": [{"bench": "finger", "seconds": 30.0, "bench_overrides": {"mass": [0.01, 0.01]}}],
}
DIAGNOSIS = "diagnosis.json"


def changed(name: str, change: Callable[[dict[str, Any]], object]) -> Damage:
    """Change the object in a JSON file in place."""

    def damage(folder: Path) -> None:
        table = json.loads((folder / name).read_text())
        change(table)
        (folder / name).write_text(json.dumps(table))

    return damage


def answer(**values: Any) -> Damage:
    """Put values into the answer."""
    return changed(DIAGNOSIS, lambda table: table.update(values))


def cause(**values: Any) -> Damage:
    """Put values into the answer's cause."""
    return changed(DIAGNOSIS, lambda table: table["effects"][0].update(values))


def estimate(**values: Any) -> Damage:
    """Put values into the estimate of the answer's cause."""

    def change(table: dict[str, Any]) -> None:
        table["effects"][0]["parameters"]["coefficient"].update(values)

    return changed(DIAGNOSIS, change)


CASES: dict[str, tuple[Damage, tuple[str, ...]]] = {
    "an answer in a list": (text(DIAGNOSIS, "[]"),
        ("diagnosis.json: a diagnosis", "holds an object, {...}; it is []")),
    "an answer of another schema": (answer(schema=2), ("schema must be 1", "it is 2")),
    "an unknown verdict": (answer(verdict="maybe"), ("no_gap, explained", "it is 'maybe'")),
    "an answer without a time": (changed(DIAGNOSIS, lambda table: table.pop("wall_time_s")),
        ("wall_time_s must be a finite number; it is missing, there are schema, verdict",)),
    "effects as words": (answer(effects=["viscous_friction"]), ("effects must be a list of obj",)),
    "a cause without a name": (cause(name=None), ("effects[0]: name must be text; it is None",)),
    "parameters as a list": (cause(parameters=[]), ("parameters must be an object; it is []",)),
    "a class of numbers": (cause(indistinguishable_from=[1]),
        ("indistinguishable_from must be a list of names; it is [1]",)),
    "a switch for a value": (estimate(value=True), ("value must be a finite number; it is True",)),
    "an interval of three": (estimate(ci95=[1, 2, 3]), ("ci95 must be 2 finite numbers",)),
    "no unit": (estimate(unit=1), ("unit must be text; it is 1",)),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_a_broken_diagnosis_is_refused_in_one_line(case: str, tmp_path: Path) -> None:
    """Every fault is named with its file."""
    damage, said = CASES[case]
    (tmp_path / DIAGNOSIS).write_text(json.dumps(ANSWER))
    read_diagnosis(tmp_path / DIAGNOSIS)
    damage(tmp_path)
    with pytest.raises(InvalidDiagnosis) as refused:
        read_diagnosis(tmp_path / DIAGNOSIS)
    assert [words for words in said if words not in str(refused.value)] == []
    assert "\n" not in str(refused.value)


def open_class(**values: Any) -> Damage:
    """Put values into the diagnosis that left a class open."""
    return changed("diagnosis.json", lambda table: table.update(values))


CLASSES: dict[str, tuple[Damage, tuple[str, ...]]] = {
    "no diagnosis": (lambda folder: (folder / "diagnosis.json").unlink(),
        ("diagnosis.json: a diagnosis is a JSON file; no such file",)),
    "no model": (lambda folder: (folder / "model.toml").unlink(),
        ("model.toml: a model is a TOML file; no such file",)),
    "an older release": (lambda folder: (folder / "diagnosis.posterior.json").unlink(),
        ("diagnosis.posterior.json: worlds are drawn from", "diagnose the data again")),
    "no noise": (open_class(noise_floor=None), ("noise_floor must be an object; it is None",)),
    "noise in words": (open_class(noise_floor={"theta": "low", "force": None}),
        ("noise_floor: theta must be a finite number; it is 'low'",)),
    "no recordings": (open_class(recorded=[]), ("recorded must be a list of objects; it is []",)),
    "overrides as a number": (open_class(recorded=[{"bench": "finger", "seconds": 1.0,
        "bench_overrides": 3}]),
        ("recorded[0]: bench_overrides must be a table of numbers; it is 3",)),
}  # fmt: skip


@pytest.mark.skipif(importlib.util.find_spec("newton") is None, reason="the simulator answers it")
@pytest.mark.parametrize("case", CLASSES)
def test_a_broken_diagnosis_is_refused_by_the_experiment_in_one_line(
    case: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Every fault of a diagnosis, or of the model beside it, is named with its file."""
    damage, said = CLASSES[case]
    model(tmp_path / "model.toml")
    (tmp_path / "diagnosis.json").write_text(json.dumps(OPEN))
    write_posterior(tmp_path / "diagnosis.json", SETS)
    damage(tmp_path)
    line = refusal(["experiment", str(tmp_path), "--out", str(tmp_path / "run.csv")], capsys)
    assert [words for words in said if words not in line] == []
