"""Bad input through the command line: one line that names what was expected, what came, where."""

from pathlib import Path

import pytest

from tendon_newton.cli import VERBS, main
from tests.bad_input.damage import Damage, cell, refusal, swap, text
from tests.importers.logs import dataset, model, xl330_log

HEADER = "t,theta,theta_dot,force\n"
ENTRY = '[[recordings]]\nfile = "train.csv"\nbench = "finger"\nsplit = "train"\n'

# what is done to a sound dataset -> what the line must say
DATASETS: dict[str, tuple[Damage, tuple[str, ...]]] = {
    "no dataset.toml": (lambda folder: (folder / "dataset.toml").unlink(),
        ("a dataset is a folder with dataset.toml",)),
    "broken TOML": (text("dataset.toml", "[[recordings]\n"),
        ("dataset.toml: must be TOML", "line 1")),
    "no recordings": (text("dataset.toml", ""), ("[[recordings]]", "lists none")),
    "missing key": (swap("dataset.toml", 'bench = "finger"\n', ""),
        ("bench must be text; it is missing",)),
    "unknown split": (swap("dataset.toml", '"train"', '"training"'),
        ("split must be one of train, test", "'training'")),
    "no train split": (swap("dataset.toml", '"train"', '"test"'), ('split = "train"',)),
    "path outside": (swap("dataset.toml", "train.csv", "../train.csv"),
        ("inside the dataset's folder", "'../train.csv'")),
    "bag": (swap("dataset.toml", "train.csv", "run.mcap"), ("run.mcap: no such file",)),
    "negative mass": (swap("dataset.toml", 'split = "train"',
        'split = "train"\nbench_overrides = {mass = -1.0}'),
        ("'mass' must lie in", "-1", "train.csv")),
    "unknown bench number": (swap("dataset.toml", 'split = "train"',
        'split = "train"\nbench_overrides = {mas = 1.0}'),
        ("No bench override named 'mas'", "did you mean 'mass'?")),
    "header only": (text("train.csv", HEADER), ("train.csv", "it has none")),
    "one row": (text("train.csv", HEADER + "0,0,0,0\n"), ("two rows or more; it has 1",)),
    "no theta": (swap("train.csv", "theta,", "angle,"), ("column 'theta' is missing", "angle")),
    "doubled column": (swap("train.csv", "theta_d,", "theta,"), ("'theta' stands 2 times",)),
    "short line": (text("train.csv", HEADER + "0,0,0,0\n1,0\n"), ("4 cells", "line 3 has 2")),
    "a word": (cell(3, 2, "abc"), ("theta must be a number; row 3 is 'abc'",)),
    "an empty cell": (cell(3, 2, ""), ("theta must be a number; row 3 is empty",)),
    "nan": (cell(4, 4, "nan"), ("force must be finite; row 4", "nan")),
    "inf": (cell(4, 3, "-inf"), ("theta_dot must be finite; row 4", "-inf")),
    "time stands still": (cell(5, 0, "0.05"), ("t must strictly increase; row 5", "train.csv")),
    "millinewtons": (cell(6, 4, "5200"),
        ("force must be in newtons; row 6", "5200", "millinewtons")),
}  # fmt: skip

MODELS: dict[str, tuple[Damage, tuple[str, ...]]] = {
    "missing": (lambda folder: (folder / "model.toml").unlink(), ("model.toml", "no such file")),
    "broken": (text("model.toml", "= 3"), ("model.toml: must be TOML",)),
    "no actuator": (text("model.toml", "fit = []\n"), ("[actuator]", "there is none")),
    "unknown key of a model": (text("model.toml", "effect = []\n"), ("no key named 'effect'",)),
    "infinite gain": (swap("model.toml", "4.2", "inf"), ("gain of 'ideal' must be finite",)),
}


@pytest.fixture
def read(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> list[str]:
    """Arguments that read the dataset and the model of a folder, and nothing else."""
    monkeypatch.setitem(VERBS, "read", "tests.formats.sessions")
    return ["read", str(tmp_path), "--model", str(tmp_path / "model.toml")]


@pytest.mark.parametrize("case", [*DATASETS, *MODELS])
def test_a_broken_dataset_or_model_is_refused_in_one_line(case, tmp_path, read, capsys) -> None:
    """Every fault is named with its place."""
    damage, said = (DATASETS | MODELS)[case]
    model(dataset(tmp_path) / "model.toml")
    assert main(read) == 0
    damage(tmp_path)
    line = refusal(read, capsys)
    assert [words for words in said if words not in line] == []


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--test", "kp=400"], "--test kp=400 meets no log; there are 200.0"),
        (["--test", "gain=200"], "No --test condition named 'gain'; known: file, kp, length"),
        (["--test", "kp"], "--test must be given as key=value"),
        (["--test", "kp=200"], "some log must be left to fit"),
        (["--test", "trajectory=a", "--train", "kp=200"], "--test and --train both select kp200_a"),
    ],
)
def test_a_split_that_cannot_be_is_refused(options, said, tmp_path, capsys) -> None:
    """Conditions must exist, select something and leave something."""
    for name in ("kp200_a.json", "kp200_b.json"):
        xl330_log(tmp_path / "logs" / name)
    arguments = ["import", "xl330", str(tmp_path / "logs"), "--out", str(tmp_path / "out")]
    assert said in refusal([*arguments, *options], capsys)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("{", "must be JSON"),
        ("[]", "must be a JSON object; it is a list"),
        ('{"mass": 0.49}', "must state 'length'; it states mass"),
        (
            '{"mass": 1, "length": 1, "kp": 0, "vin": 7, "entries": [0]}',
            "timestamp must be a number",
        ),
        ('{"mass": 1, "length": 1, "kp": 1, "vin": 7, "entries": []}', "one object per row"),
        ('{"mass": 1, "length": 1, "kp": 1, "vin": 7, "entries": [], "motor": "mx106"}', "'mx106'"),
    ],
)
def test_a_broken_log_is_refused_with_its_name(content, said, tmp_path, capsys) -> None:
    """A log that lacks something is named, and nothing is written."""
    (tmp_path / "log.json").write_text(content)
    line = refusal(["import", "xl330", str(tmp_path), "--out", str(tmp_path / "out")], capsys)
    assert said in line
    assert "log.json" in line
    assert not (tmp_path / "out").exists()
