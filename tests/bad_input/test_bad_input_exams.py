"""Broken exams and diagnoses through the command line."""

import importlib.util
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tendon_lab.exam.run_exam import QUESTION, question_of
from tendon_newton.cli import main
from tendon_newton.diagnosis.posterior import FittedSet, Posterior, write_posterior
from tests.bad_input.damage import Damage, junk, refusal, replaced, swap, text
from tests.importers.logs import dataset, model

TRUTH: dict[str, Any] = {
    "id": "c001",
    "family": "single",
    "effects": [{"name": "viscous_friction", "parameters": {"coefficient": 1.5}}],
    "outside": [],
    "strength": {"ratio": 3.0},
    "weak": False,
}
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
TRUTH_FILE = "exam/truth/c001.json"
ANSWER_FILE = "out/c001/diagnosis.json"


def exam(folder: Path) -> list[str]:
    """Write an exam of one dataset whose answer is already there, and return what takes it."""
    data = dataset(folder / "exam/c001")
    model(data / "model.toml")
    answer = {**ANSWER, QUESTION: question_of(data)}
    for name, table in ((TRUTH_FILE, TRUTH), (ANSWER_FILE, answer)):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(json.dumps(table, indent=1))
    return ["exam", str(folder / "exam"), "--out", str(folder / "out"), "--jobs", "1"]


def changed(name: str, change: Callable[[dict[str, Any]], object]) -> Damage:
    """Change the object in a JSON file in place."""

    def damage(folder: Path) -> None:
        table = json.loads((folder / name).read_text())
        change(table)
        (folder / name).write_text(json.dumps(table))

    return damage


def truth(**values: Any) -> Damage:
    """Put values into the truth."""
    return changed(TRUTH_FILE, lambda table: table.update(values))


def answer(**values: Any) -> Damage:
    """Put values into the answer."""
    return changed(ANSWER_FILE, lambda table: table.update(values))


def cause(**values: Any) -> Damage:
    """Put values into the answer's cause."""
    return changed(ANSWER_FILE, lambda table: table["effects"][0].update(values))


def estimate(**values: Any) -> Damage:
    """Put values into the estimate of the answer's cause."""

    def change(table: dict[str, Any]) -> None:
        table["effects"][0]["parameters"]["coefficient"].update(values)

    return changed(ANSWER_FILE, change)


CASES: dict[str, tuple[Damage, tuple[str, ...]]] = {
    "no truths": (lambda folder: (folder / TRUTH_FILE).unlink(),
        ("an exam holds folders with dataset.toml", "no truth was found")),
    "a truth without its dataset": (lambda folder: (folder / "exam/c001/dataset.toml").unlink(),
        ("truth/c001.json speaks of c001/, which has no dataset.toml",)),
    "a folder for a truth": (replaced(TRUTH_FILE, Path.mkdir), ("c001.json", "it is a folder")),
    "a loop for a truth": (replaced(TRUTH_FILE, lambda path: path.symlink_to(path.name)),
        ("c001.json", "no such file")),
    "an empty truth": (text(TRUTH_FILE, ""), ("must be JSON", "char 0")),
    "half a truth": (text(TRUTH_FILE, json.dumps(TRUTH)[:60]),
        ("c001.json", "must be JSON", "line 1")),
    "a binary truth": (junk(TRUTH_FILE, b"\x80\x00"), ("must be UTF-8; byte 0",)),
    "a truth with a zero byte": (text(TRUTH_FILE, "{}\0"), ("zero byte at character 2",)),
    "a list for a truth": (text(TRUTH_FILE, "[]"), ("holds an object, {...}; it is []",)),
    "a deep truth": (text(TRUTH_FILE, 100_000 * "["), ("nested too deeply",)),
    "a truth with half a character": (swap(TRUTH_FILE, "single", r"\ud800"),
        ("c001.json", "half of a character")),
    "a truth of another name": (truth(id="c002"), ("'c001'; it is 'c002'",)),
    "a truth that leads away": (truth(id="../../c001"), ("it is '../../c001'",)),
    "an unknown family": (truth(family="triple"), ("single, pair", "it is 'triple'")),
    "a family that is a list": (truth(family=["single"]), ("it is ['single']",)),
    "effects as an object": (truth(effects={}), ("effects must be a list of objects",)),
    "an effect without a name": (truth(effects=[{"parameters": {}}]),
        ("effects[0]: name must be text; it is missing",)),
    "an effect without numbers": (truth(effects=[{"name": "backlash"}]),
        ("effects[0]: parameters must be an object of finite numbers; it is missing",)),
    "a word for a true number": (truth(effects=[{"name": "backlash",
        "parameters": {"width": "wide"}}]), ("effects[0]: parameters must be", "'wide'")),
    "a true number that is none": (truth(effects=[{"name": "backlash",
        "parameters": {"width": float("nan")}}]), ("must be JSON: NaN is not a number",)),
    "a true number beyond floats": (truth(effects=[{"name": "backlash",
        "parameters": {"width": 10**400}}]),
        ("effects[0]: parameters must be an object of finite numbers",)),
    "a true number of 5000 digits": (swap(TRUTH_FILE, "1.5", 5000 * "9"),
        ("must be JSON", "5000 digits")),
    "words for causes outside": (truth(outside=["magic"]), ("outside must be a list of objects",)),
    "numbers for what imitates": (truth(outside=[{"name": "magic", "near": [1]}]),
        ("outside[0]: near must be a list of names; it is [1]",)),
    "a word for a strength": (truth(strength="strong"), ("strength must be an object",)),
    "an answer in a list": (text(ANSWER_FILE, "[]"), ("diagnosis.json", "schema must be 1")),
    "an answer of another schema": (answer(schema=2), ("schema must be 1", "it is 2")),
    "an unknown verdict": (answer(verdict="maybe"), ("no_gap, explained", "it is 'maybe'")),
    "an answer without a time": (changed(ANSWER_FILE, lambda table: table.pop("wall_time_s")),
        ("wall_time_s must be a finite number; it is missing, there are schema, verdict",)),
    "effects as words": (answer(effects=["viscous_friction"]), ("effects must be a list of obj",)),
    "a cause without a name": (cause(name=None), ("effects[0]: name must be text; it is None",)),
    "a cause without a side": (cause(side=7), ("effects[0]: side must be text; it is 7",)),
    "parameters as a list": (cause(parameters=[]), ("parameters must be an object; it is []",)),
    "a number for an estimate": (cause(parameters={"coefficient": 1.5}),
        ("parameters: coefficient must be an object; it is 1.5",)),
    "a class of numbers": (cause(indistinguishable_from=[1]),
        ("indistinguishable_from must be a list of names; it is [1]",)),
    "no value": (estimate(value=None), ("coefficient: value must be a finite number",)),
    "a switch for a value": (estimate(value=True), ("value must be a finite number; it is True",)),
    "an interval of three": (estimate(ci95=[1, 2, 3]), ("ci95 must be 2 finite numbers",)),
    "an interval of words": (estimate(ci95=["a", "b"]), ("2 finite numbers; it is ['a', 'b']",)),
    "no unit": (estimate(unit=1), ("unit must be text; it is 1",)),
}  # fmt: skip


def test_the_sound_exam_is_taken(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The exam that the cases spoil gives a mark, without diagnosing again."""
    assert main(exam(tmp_path)) == 0
    assert "viscous_friction -> viscous_friction" in capsys.readouterr().out


@pytest.mark.parametrize("case", CASES)
def test_a_broken_exam_is_refused_in_one_line(case, tmp_path, capsys) -> None:
    """Every fault of a truth or of an answer is named with its file."""
    damage, said = CASES[case]
    arguments = exam(tmp_path)
    damage(tmp_path)
    line = refusal(arguments, capsys)
    assert [words for words in said if words not in line] == []


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


def test_a_dataset_that_the_exam_does_not_hold_is_named(tmp_path, capsys) -> None:
    """--only with a name outside the exam lists what is inside."""
    line = refusal([*exam(tmp_path), "--only", "c002"], capsys)
    assert "No dataset named 'c002'; did you mean 'c001'? known: c001" in line
