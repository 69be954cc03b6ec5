"""A class of causes is settled by the run that the program proposes."""

import csv
import json
import tomllib
from pathlib import Path

import numpy as np
import pytest

from tendon_newton.cli import main
from tendon_newton.data.dataset import load_dataset, write_dataset
from tendon_newton.data.excitations import LARGEST_COMMAND
from tendon_newton.diagnosis.explanation import Setting
from tendon_newton.diagnosis.next_experiment.open_sets_file import read_open_sets
from tendon_newton.diagnosis.next_experiment.run_design import separating_run
from tendon_newton.diagnosis.posterior import (
    Coordinate,
    FittedSet,
    OpenNumber,
    Posterior,
    write_posterior,
)
from tendon_newton.errors import NothingToSeparate
from tests.planted.generator import Recipe, make_dataset
from tests.planted.physics.bench import BENCHES
from tests.planted.physics.causes import Causes
from tests.planted.physics.plant import Run, simulate
from tests.planted.physics.sensors import Sensors
from tests.planted.recordings import Slot, record
from tests.proposed import proposed

# A tilted rail pulls a slider with a constant force, and so would a spring whose zero has moved:
# on one spring a small tilt is the same but for the noise, and only a finger tells them apart.
TILTED = Recipe(effects=("gravity_misalignment",), seed=2, mix="W", duration=(4.0, 5.0), size=0.12)
TILT, OFFSET = ("gravity_misalignment", "angle", 0.08), ("position_offset", "angle", 0.013)
"""About alike on a weak spring."""
PROPOSED = "record 12 s of stairs on bench finger"
WORDS = ("--duration", 4, "--benches", "finger", "spring_weak")


def run_verb(*words: object) -> None:
    """Run the command line as a user would."""
    assert main([str(word) for word in words]) == 0


def stated(folder: Path) -> dict:
    """Read what a diagnosis says."""
    return json.loads((folder / "diagnosis.json").read_text(encoding="utf-8"))


def record_run(dataset: Path, command: Path, causes: Causes, rng: np.random.Generator) -> None:
    """Play a command file to the planted plant and add the recording to a dataset."""
    table = np.genfromtxt(command, delimiter=",", names=True)
    bench = tomllib.loads(command.with_suffix(".toml").read_text(encoding="utf-8"))["bench"]
    run = Run(bench=BENCHES[bench], causes=causes, time=table["t"], command=table["theta_d"])
    slot = Slot(file=f"{bench}_proposed.csv", bench=bench, kind="proposed")
    new = record(rng, slot, run, simulate([run])[0], Sensors(), gaps=False)
    old = load_dataset(dataset)
    write_dataset(dataset, (*old.train, new), old.test)


@pytest.mark.slow
def test_the_proposed_run_settles_a_class(tmp_path: Path, rng: np.random.Generator) -> None:
    """Two causes that one spring cannot tell apart; recorded as proposed, the true one is left."""
    dataset, model = tmp_path / "dataset", tmp_path / "dataset" / "model.toml"
    truth = make_dataset(dataset, TILTED)
    run_verb("diagnose", dataset, "--model", model, "--out", tmp_path / "first")
    (cause,) = stated(tmp_path / "first")["effects"]
    assert {cause["name"], *cause["indistinguishable_from"]} > {"gravity_misalignment"}
    assert cause["separating_experiment"].startswith("record 12 s of")

    command = tmp_path / "next" / "run.csv"
    run_verb("experiment", tmp_path / "first", "--out", command)
    assert command.with_suffix(".png").stat().st_size > 10_000
    tilt = truth.parameters["gravity_misalignment"]["angle"]
    record_run(dataset, command, Causes(tilt=tilt, bristle=truth.bristle), rng)
    run_verb("diagnose", dataset, "--model", model, "--out", tmp_path / "second")
    (settled,) = stated(tmp_path / "second")["effects"]
    assert settled["name"] == "gravity_misalignment"
    assert settled["indistinguishable_from"] == []


def test_a_command_file_stays_inside_the_servos_range(tmp_path, capsys) -> None:
    """Two columns, even steps from 0, and angles that the servo accepts; what is expected is said.

    A weak spring cannot tell these two: the run is one of the finger.
    """
    path = tmp_path / "run.csv"
    write_open_sets(tmp_path, TILT, OFFSET)
    run_verb("experiment", tmp_path, "--out", path, *WORDS)
    with path.open(encoding="utf-8") as file:
        header, *rows = csv.reader(file)
    table = np.array(rows, dtype=float)
    assert header == ["t", "theta_d"]
    assert table[0, 0] == 0.0
    assert np.diff(table[:, 0]) == pytest.approx(1.0 / 80.0, abs=1e-6)  # rounded to microseconds
    assert table[:, 1].min() >= 0.0
    assert table[:, 1].max() <= LARGEST_COMMAND + 1e-6
    setting = tomllib.loads(path.with_suffix(".toml").read_text(encoding="utf-8"))
    assert setting["bench"] == "finger"
    assert setting["expected_bits"]["names"] > 0.5
    said = capsys.readouterr().out
    assert "1.0 bits about names are open" in said
    assert [words[0] for words in proposed(said)] == ["explain"]


def test_a_diagnosis_that_leaves_one_set_needs_no_run(tmp_path, capsys) -> None:
    """One line that says what there is; nothing is written, and nothing went wrong."""
    write_open_sets(tmp_path, TILT)
    assert main(["experiment", str(tmp_path), "--out", str(tmp_path / "run.csv")]) == 0
    (line,) = capsys.readouterr().out.splitlines()
    assert not (tmp_path / "run.csv").exists()
    assert line.startswith("no run is needed")
    assert "gravity_misalignment" in line
    assert "leaves no other set open" in line


def test_a_class_that_a_diagnosis_names_is_open(tmp_path, capsys) -> None:
    """Its causes are equally likely however small a weight the posterior gives one of them.

    Where the posterior has no numbers of them, what the diagnosis proposes is said.
    """
    write_open_sets(tmp_path, TILT, OFFSET, weights=(0.999, 0.0005))
    question, _ = read_open_sets(tmp_path)
    assert question.weights.tolist() == [0.5, 0.5]
    write_open_sets(tmp_path, TILT, OFFSET, weights=(1.0,))
    assert main(["experiment", str(tmp_path), "--out", str(tmp_path / "run.csv")]) == 0
    (line,) = capsys.readouterr().out.splitlines()
    assert line.startswith("no run is designed")
    assert line.endswith(f"It proposes: {PROPOSED}")


def test_a_cause_without_a_name_closes_no_class(tmp_path: Path) -> None:
    """Sets of one class may all have it, as the written model does."""
    write_open_sets(tmp_path, TILT, OFFSET, weights=(0.999, 0.0005), unnamed=("backlash",))
    question, _ = read_open_sets(tmp_path)
    assert question.weights.tolist() == [0.5, 0.5]


def test_a_set_of_next_to_no_weight_is_not_open(tmp_path: Path) -> None:
    """Where no name is in doubt no run is promised for what has a weight of 0.01 %."""
    write_open_sets(tmp_path, TILT, OFFSET, weights=(0.9999, 0.0001))
    path = tmp_path / "diagnosis.json"
    alone = path.read_text(encoding="utf-8").replace('["position_offset"]', "[]")
    path.write_text(alone, encoding="utf-8")
    with pytest.raises(NothingToSeparate, match="no run is designed"):
        read_open_sets(tmp_path)


def test_what_predicts_the_same_everywhere_is_not_promised_a_run(tmp_path: Path) -> None:
    """A cause against itself: no run of the library; against another that a finger tells: one."""
    spring, finger = Setting(bench="spring_weak"), Setting(bench="finger")
    for others, settings, words in (
        (TILT, (spring,), "no run of the library does: of"),
        (OFFSET, (spring, finger), "record 4 s of"),
    ):
        write_open_sets(tmp_path, TILT, others)
        question, _ = read_open_sets(tmp_path)
        text = separating_run(question, settings, ("a", "b"), duration=4.0)
        assert text.startswith(words)
        assert "of 1.0 bits that tell a from b, " in text
    assert "on bench finger" in text


def sets_of(
    *shares: tuple[tuple[str, str, float], float], unnamed: tuple[str, ...] = ()
) -> Posterior:
    """Sets of one cause each, whose number is known to a hundredth of a radian."""
    scale = Coordinate(kind="linear", origin=0.0, unit=1.0, lower=-1.5, upper=1.5)
    return Posterior(
        sets=tuple(
            FittedSet(
                weight=share,
                causes=(owner, *unnamed),
                numbers=(OpenNumber(owner=owner, name=name, coordinate=scale, place=value),),
                covariance=np.array([[(0.01 / 1.96) ** 2]]),
            )
            for (owner, name, value), share in shares
        )
    )


def write_open_sets(
    folder: Path,
    *causes: tuple[str, str, float],
    weights: tuple[float, ...] = (),
    unnamed: tuple[str, ...] = (),
) -> None:
    """Write a diagnosis that names the first cause and leaves sets with the others open."""
    names = [name for name, *_ in causes]
    suspected = {"side": "actuator", "parameters": {}, "indistinguishable_from": []}
    table = {
        "schema": 1,
        "verdict": "explained",
        "wall_time_s": 1.0,
        "noise_floor": {"theta": 0.00044, "force": 0.05},
        "recorded": [{"bench": "spring_weak", "seconds": 60.0}],
        "effects": [
            {
                "name": names[0],
                "side": "mechanism",
                "parameters": {causes[0][1]: {"value": 0.3, "ci95": [0.29, 0.31], "unit": "rad"}},
                "indistinguishable_from": names[1:],
                "separating_experiment": PROPOSED if names[1:] else None,
            }
        ],
        "suspected": [{"name": name, **suspected} for name in unnamed],
    }
    (folder / "diagnosis.json").write_text(json.dumps(table), encoding="utf-8")
    shares = list(zip(causes, weights or len(causes) * (1.0 / len(causes),), strict=False))
    write_posterior(folder / "diagnosis.json", sets_of(*shares, unnamed=unnamed))
    (folder / "model.toml").write_text(
        '[actuator]\nkind = "ideal"\ngain = 4.2\nspool_radius = 0.0125\n', encoding="utf-8"
    )
