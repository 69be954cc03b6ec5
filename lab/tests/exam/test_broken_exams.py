"""Broken exams through the command line."""

import json
from pathlib import Path
from typing import Any

import pytest

from tendon_lab.exam.run_exam import QUESTION, question_of
from tendon_newton.cli import main
from tests.bad_input.damage import Damage, junk, refusal, replaced, swap, text
from tests.bad_input.test_bad_input_diagnoses import ANSWER, changed
from tests.importers.logs import dataset, model

TRUTH: dict[str, Any] = {
    "id": "c001",
    "family": "single",
    "effects": [{"name": "viscous_friction", "parameters": {"coefficient": 1.5}}],
    "outside": [],
    "weak": False,
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


def truth(**values: Any) -> Damage:
    """Put values into the truth."""
    return changed(TRUTH_FILE, lambda table: table.update(values))


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


def test_a_dataset_that_the_exam_does_not_hold_is_named(tmp_path, capsys) -> None:
    """--only with a name outside the exam lists what is inside."""
    line = refusal([*exam(tmp_path), "--only", "c002"], capsys)
    assert "No dataset named 'c002'; did you mean 'c001'? known: c001" in line
