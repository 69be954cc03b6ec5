"""Mistakes of a first hour: each is told in one line that says how to mend it.

Nothing is simulated here. Mistakes in recorded data are in `tests/importers/test_gate.py`.
"""

import shlex
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

from tendon_newton.cli import main
from tendon_newton.data.dataset import write_dataset
from tests.bad_input.damage import swap, text
from tests.diagnosis.test_diagnosed_bench import diagnosis
from tests.importers.logs import dataset, model, recording
from tests.importers.test_rosbag import MAPPING as TOPICS
from tests.importers.test_rosbag import Bag
from tests.proposed import proposed

Change = Callable[[Path], object]
MAPPING = """bench = "finger"
[columns]
t = {column = "t"}
theta_d = {column = "goal"}
theta = {column = "q"}
theta_dot = {derive = "theta"}
"""
IMPORT = "import mapped raw --mapping mapping.toml --out new"


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a dataset, its model, a diagnosis, raw logs and their mapping."""
    folder = tmp_path_factory.mktemp("lab")
    model(dataset(folder / "data") / "model.toml")
    diagnosis(folder / "found", "thumb")
    (folder / "raw").mkdir()
    for run in ("run_1", "run_2"):
        rows = [f"{0.0125 * k},{1.0},{0.8}" for k in range(200)]
        (folder / "raw" / f"{run}.csv").write_text("\n".join(["t,goal,q", *rows]) + "\n")
    (folder / "mapping.toml").write_text(MAPPING)
    return folder


def removed(file: str) -> Change:
    """Return the loss of a file."""
    return lambda folder: (folder / file).unlink()


def untested(folder: Path) -> None:
    """Leave no recording to test on."""
    write_dataset(folder / "data", [recording("train.csv")], [])


def thumbs(folder: Path) -> None:
    """Record an earlier day of the thumb."""
    shutil.copytree(folder / "data", folder / "old")
    path = folder / "old" / "dataset.toml"
    path.write_text(path.read_text().replace('"finger"', '"thumb"'))


def bagged(folder: Path) -> None:
    """Have a folder of ROS 2 bags for the logs."""
    shutil.rmtree(folder / "raw")
    (folder / "raw").mkdir()
    Bag(stamped=False).write(folder / "raw" / "bag_1")
    (folder / "mapping.toml").write_text(f'bench = "finger"\nclock = "log"\n{TOPICS}')


@dataclass(frozen=True, kw_only=True)
class Mistake:
    """What somebody types, after what somebody did, and what is said."""

    words: str
    said: tuple[str, ...]
    change: Change = lambda folder: None


ACTUATOR = '[actuator]\nkind = "ideal"\ngain = 4.2\nspool_radius = 0.0125\n'
PWM = """[actuator]
kind = "pwm_servo"
duty_per_rad = 1.15
max_duty = 1.0
supply_voltage = 5.0
torque_constant = 0.4
resistance = 5.0
armature = 0.001
spool_radius = 0.0125
"""
DIAGNOSE = "diagnose data --out new"
OWN_ASSETS = "your own are looked for in the folders in TENDON_NEWTON_ASSETS"
MISTAKES: dict[str, Mistake] = {
    "raw logs": Mistake(words="diagnose raw --out new",
        said=("this one holds logs", "tendon-newton import mapped raw")),
    "raw logs to be examined": Mistake(words="doctor raw",
        said=("this one holds logs", "tendon-newton import mapped raw")),
    "a raw log": Mistake(words="diagnose raw/run_1.csv --out new", said=("this is a log",)),
    "a raw log to be drawn": Mistake(words="plot raw/run_1.csv", said=("by import mapped",)),
    "a raw log of semicolons to be drawn": Mistake(words="plot raw/run_1.csv",
        said=("line 1 has none", "by import mapped"), change=text("raw/run_1.csv", "t;goal;q\n")),
    "bags to be examined": Mistake(words="doctor raw", change=bagged,
        said=("this one holds logs (bag_1)", "tendon-newton import mapped raw")),
    "nothing to be examined": Mistake(words="doctor nowhere",
        said=("nowhere: a dataset is a folder with", "or meta/info.json: no such folder")),
    "logs of another ending": Mistake(words=IMPORT, said=("no log matches", "there are run_1.txt"),
        change=lambda f: [p.rename(p.with_suffix(".txt")) for p in (f / "raw").iterdir()]),
    "no such folder": Mistake(words="diagnose nowhere --out new", said=("no such folder",)),
    "a file for a folder": Mistake(words="diagnose mapping.toml --out new",
        said=("mapping.toml is a file, no folder",)),
    "no model": Mistake(words=DIAGNOSE,
        said=("a diagnosis starts from a model", "Name one with --model"),
        change=removed("data/model.toml")),
    "no test split": Mistake(words=DIAGNOSE,
        said=('give at least one whole recording split = "test"', "--hold-out 0.3"),
        change=untested),
    "a share of 2": Mistake(words=f"{DIAGNOSE} --hold-out 2", said=("must be 0.05 to 0.8",)),
    "held out twice": Mistake(words=f"{DIAGNOSE} --hold-out 0.3",
        said=('data has 1 with split = "test"',)),
    "a time in words": Mistake(words=f"{DIAGNOSE} --budget soon", said=("90s, 5min or 1h",)),
    "no core": Mistake(words=f"{DIAGNOSE} --jobs 0", said=("must be 1 to 1024 cores",)),
    "a file for results": Mistake(words="diagnose data --out mapping.toml",
        said=("results need a folder; it is a file",)),
    "a key of the dataset": Mistake(words=DIAGNOSE,
        said=("no key named 'splitt'; did you mean 'split'?",),
        change=swap("data/dataset.toml", "split =", "splitt =")),
    "an own bench": Mistake(words="simulate data --model data/model.toml --out new",
        said=("No asset named 'my_finger'", OWN_ASSETS),
        change=swap("data/dataset.toml", '"finger"', '"my_finger"')),
    "a P register for a duty": Mistake(words=DIAGNOSE,
        said=("duty_per_rad of actuator 'pwm_servo' must be between 0.00333 and 300 1/rad",
              "on finger", "P-gain registers", "it is 850"),
        change=text("data/model.toml", PWM.replace("1.15", "850.0"))),
    "a rotor in g cm2": Mistake(words="simulate data --model data/model.toml --out new",
        said=("armature of actuator 'pwm_servo' must be between 0 and 0.3 kg m2", "it is 12"),
        change=text("data/model.toml", PWM.replace("armature = 0.001", "armature = 12.0"))),
    "a rotor in g cm2 to train on": Mistake(
        words="train-policy --force heavy.toml --out new --worlds 16 --iterations 1",
        said=("armature of actuator 'pwm_servo' must be between 0 and 0.3 kg m2", "it is 12"),
        change=text("heavy.toml", PWM.replace("armature = 0.001", "armature = 12.0"))),
    "a gain in N/m": Mistake(words="export data/model.toml --to mujoco --bench finger --out new",
        said=("gain of actuator 'ideal' must be between", "300 N/rad on finger", "it is 4200"),
        change=text("data/model.toml", ACTUATOR.replace("4.2", "4200.0"))),
    "a unit for data of ours": Mistake(words="doctor data --unit deg",
        said=("data: --unit and --calibration are for LeRobotDatasets", "in SI units")),
    "a dataset to be drawn": Mistake(words="plot data",
        said=("data: a picture is of one log", ".mcap, .csv", "data/train.csv")),
    "a model to be drawn": Mistake(words="plot data/model.toml",
        said=("data/model.toml: a picture is of one log", ".mcap, .csv")),
    "a folder of diagnoses": Mistake(words="diagnose all --out new",
        said=("all: a dataset is a folder with dataset.toml", "diagnoses of lift, pan"),
        change=lambda folder: [shutil.copytree(folder / "found", folder / "all" / joint)
                               for joint in ("pan", "lift")]),
    "ours taken for LeRobot's": Mistake(words="import lerobot data --out new",
        said=("data: is a dataset of ours already", "tendon-newton diagnose data")),
    "ours to be mapped": Mistake(words="import mapped data --mapping mapping.toml --out new",
        said=("data: is a dataset of ours already", "tendon-newton diagnose data")),
    "a file to be examined": Mistake(words="doctor mapping.toml",
        said=("mapping.toml: a dataset is a folder with dataset.toml or meta/info.json",)),
    "a day against itself": Mistake(words="diagnose data --against data --out new",
        said=("data: a day is held against another one", "--against names the same")),
    "a bench to experiment on": Mistake(words="experiment found --out run.csv --benches fingr",
        said=("No bench named 'fingr'; did you mean 'finger'?",)),
    "an only log for a folder": Mistake(
        words="import mapped raw/run_1.csv --mapping mapping.toml --out new",
        said=("raw/run_1.csv: logs come as a folder", "name raw, and files = 'run_1.csv'")),
    "a mapping for a dataset's list": Mistake(
        words="import mapped raw --mapping data/dataset.toml --out new",
        said=("data/dataset.toml: is the list of a dataset", "mapping.toml says")),
    "a format": Mistake(words="import xl430 raw --out new", said=("did you mean 'xl330'?",)),
    "a key of a mapping": Mistake(words=IMPORT,
        said=("no key named 'benc'; did you mean 'bench'?",),
        change=swap("mapping.toml", "bench =", "benc =")),
    "all rows empty": Mistake(words=IMPORT, said=("a log has two rows or more", "2 of them lack q"),
        change=text("raw/run_1.csv", "t,goal,q\n0,1,nan\n0.01,1,\n")),
    "a line below the rows": Mistake(words=IMPORT, said=("has 'end of run'", 'comment = "end"'),
        change=text("raw/run_1.csv", "t,goal,q\n0,1,1\n0.01,1,1\nend of run\n")),
    "an import over a dataset": Mistake(words="import mapped raw --mapping mapping.toml --out data",
        said=("it holds a dataset that was not imported",)),
    "a day of another bench": Mistake(words="diagnose data --against old --out new",
        said=("data: a day is held against", "old is of thumb, this day of finger"), change=thumbs),
    "a day since another bench's diagnosis":
        Mistake(words="diagnose data --against found --out new",
        said=("found is of thumb, this day of finger", "without --against")),
    "a target": Mistake(words="export found --to mujco --out new", said=("mean 'mujoco'?",)),
    "a finger as an arm": Mistake(words="export found --to urdf --out new",
        said=("takes arms", "'thumb' goes to mujoco, newton, usd")),
    "a port": Mistake(words="collect --port virtal --out new", said=("did you mean 'virtual'?",)),
    "a policy": Mistake(words="deploy --policy finger-stair --port virtual --out new",
        said=("that come along, by name: finger-stairs",)),
    "a network": Mistake(words="train-force data --network transformr --out new",
        said=("mean 'transformer'?",)),
    "a command file": Mistake(words="experiment found --out run.txt",
        said=("a command file is a CSV file, NAME.csv",)),
    "a log in another coding": Mistake(words=IMPORT, said=("iconv -f utf-16 -t utf-8",),
        change=lambda f: (f / "raw" / "run_1.csv").write_bytes("t,goal,q\n".encode("utf-16"))),
}  # fmt: skip


@pytest.mark.parametrize("name", MISTAKES)
def test_a_mistake_is_told_in_one_line_with_the_mend(
    name, lab, tmp_path, capsys, monkeypatch
) -> None:
    """Exit code 2, one line on the error stream, and no results that could be taken for some."""
    mistake, folder = MISTAKES[name], tmp_path / "lab"
    shutil.copytree(lab, folder)
    mistake.change(folder)
    monkeypatch.chdir(folder)
    assert main(shlex.split(mistake.words)) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert [words for words in mistake.said if words not in line] == []
    for words in proposed(line):
        assert main(words) == 0
    assert not [path for path in folder.rglob("new/*") if path.is_file()]
