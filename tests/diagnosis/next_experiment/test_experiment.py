"""A class of causes is settled by the run that the program proposes."""

import csv
import json
import tomllib
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tendon_newton.cli import main
from tendon_newton.data.dataset import load_dataset, write_dataset
from tendon_newton.data.excitations import LARGEST_COMMAND
from tendon_newton.data.model_file import Model, NamedValues
from tendon_newton.diagnosis.explanation import Estimate, Explanation, OpenClass, Setting
from tendon_newton.diagnosis.imitation import Likeness
from tendon_newton.diagnosis.next_experiment.open_class_file import read_open_class
from tendon_newton.diagnosis.next_experiment.separation import NO_RUN, propose, repeats_needed
from tendon_newton.identification.noise_floor import NoiseFloor
from tests.planted.generator import Recipe, make_dataset
from tests.planted.physics.bench import BENCHES
from tests.planted.physics.causes import Causes
from tests.planted.physics.plant import Run, simulate
from tests.planted.physics.sensors import Sensors
from tests.planted.recordings import Slot, record

# A tilted rail pulls a slider with a constant force, and so would a spring whose zero has moved:
# on one spring a small tilt is the same but for the noise, and only a finger tells them apart.
TILTED = Recipe(effects=("gravity_misalignment",), seed=2, mix="W", duration=(4.0, 5.0), size=0.12)
MODEL = Model(actuator=NamedValues(name="ideal", values={"gain": 4.2, "spool_radius": 0.0125}))
NOISE = NoiseFloor(theta=0.00044, force=0.05)


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


def test_a_command_file_stays_inside_the_servos_range(tmp_path: Path) -> None:
    """Two columns, even steps from 0, and angles that the servo accepts."""
    path = tmp_path / "run.csv"
    write_open_class(tmp_path, ("gravity_misalignment", "angle"), ("position_offset", "angle"))
    run_verb("experiment", tmp_path, "--out", path, "--duration", 5, "--benches", "finger")
    with path.open(encoding="utf-8") as file:
        header, *rows = csv.reader(file)
    table = np.array(rows, dtype=float)
    assert header == ["t", "theta_d"]
    assert table[0, 0] == 0.0
    assert np.diff(table[:, 0]) == pytest.approx(1.0 / 80.0, abs=1e-6)  # rounded to microseconds
    assert table[:, 1].min() >= 0.0
    assert table[:, 1].max() <= LARGEST_COMMAND + 1e-6
    assert tomllib.loads(path.with_suffix(".toml").read_text(encoding="utf-8"))["bench"] == "finger"


def test_a_diagnosis_without_a_class_needs_no_run(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """One line that says what there is; nothing is written, and nothing went wrong."""
    write_open_class(tmp_path, ("gravity_misalignment", "angle"))
    assert main(["experiment", str(tmp_path), "--out", str(tmp_path / "run.csv")]) == 0
    (line,) = capsys.readouterr().out.splitlines()
    assert not (tmp_path / "run.csv").exists()
    assert line.startswith("no run is needed")
    assert "gravity_misalignment" in line
    assert "leaves none of them open" in line


def question(*causes: tuple[str, str, float]) -> OpenClass:
    """A class of causes on a weak spring, each with one number that the data know well."""
    return OpenClass(
        explanations=tuple(
            Explanation(
                cause=name,
                numbers={name: {parameter: Estimate(value=v, ci95=(0.99 * v, 1.01 * v), unit="1")}},
            )
            for name, parameter, v in causes
        ),
        without=MODEL,
        settings=(Setting(bench="spring_weak", seconds=60.0),),
        noise=NOISE,
    )


def test_what_predicts_the_same_everywhere_is_not_promised_a_run() -> None:
    """A cause against itself: no run of the library, however often."""
    same = question(("coulomb_friction", "force", 1.0), ("coulomb_friction", "force", 1.0))
    best = propose(same, benches=("spring_weak",), duration=4.0)[0]
    assert best.repeats is None
    assert best.open == (("coulomb_friction", "coulomb_friction"),)
    assert best.text().startswith("no run of the library does")


def test_an_imitator_may_refit_its_numbers() -> None:
    """A number that the data leave open imitates more than one that they have pinned."""
    pinned = question(("coulomb_friction", "force", 1.0), ("viscous_friction", "coefficient", 1.0))
    free = replace(
        pinned, explanations=tuple(widened(explanation) for explanation in pinned.explanations)
    )
    left = [
        sum(p.hardest.behind for p in propose(q, benches=("spring_weak",), duration=4.0))
        for q in (pinned, free)
    ]
    assert left[1] < left[0]


def widened(explanation: Explanation) -> Explanation:
    """The same cause with intervals as wide as its numbers."""
    return replace(
        explanation,
        numbers={
            owner: {name: replace(e, ci95=(0.0, 2.0 * e.value)) for name, e in numbers.items()}
            for owner, numbers in explanation.numbers.items()
        },
    )


def test_more_data_at_hand_need_more_repeats() -> None:
    """What differs in the new run must count beside all that the cause explains in the old ones."""
    like = Likeness(
        pair=("a", "b"),
        theta=0.01,
        force=None,
        separation=20.0,
        behind=100.0,
        scatter=1.0,
        gain=500.0,
    )
    needed = [repeats_needed(like, recorded) for recorded in (0.0, 10_000.0, 40_000.0)]
    # 3 % of 10,000 over 100 - 3 % of 500 is 3.5; four times as much needs 14.1
    assert needed == [1, 4, 15]
    assert repeats_needed(replace(like, behind=10.0), 0.0) is None


def test_the_class_that_a_run_separates_comes_first(tmp_path: Path) -> None:
    """Not the first one, of which the diagnosis says itself that no run tells it."""
    write_open_class(tmp_path, ("tendon_slack", "length"), ("backlash", "width"))
    file = tmp_path / "diagnosis.json"
    table = json.loads(file.read_text())
    (first,) = table["effects"]
    second = first | {"name": "backlash", "explanations": first["explanations"][::-1]}
    first["separating_experiment"] = f"{NO_RUN}; the best is to record for ever"
    second["separating_experiment"] = "record 12 s of chirp on bench finger"
    file.write_text(json.dumps(table | {"effects": [first, second]}))
    assert read_open_class(tmp_path).explanations[0].cause == "backlash"
    assert read_open_class(tmp_path, "tendon_slack").explanations[0].cause == "tendon_slack"
    second["separating_experiment"] = first["separating_experiment"]
    file.write_text(json.dumps(table | {"effects": [first, second]}))
    assert read_open_class(tmp_path).explanations[0].cause == "tendon_slack"


def write_open_class(folder: Path, *causes: Sequence[str]) -> None:
    """Write a diagnosis that names the first cause and leaves the others open."""
    estimates = [{"value": 0.3, "ci95": [0.29, 0.31], "unit": "rad"} for _ in causes]
    table = {
        "schema": 1,
        "verdict": "explained",
        "wall_time_s": 1.0,
        "noise_floor": {"theta": 0.00044, "force": 0.05},
        "recorded": [{"bench": "spring_weak", "seconds": 60.0}],
        "effects": [
            {
                "name": causes[0][0],
                "side": "mechanism",
                "parameters": {causes[0][1]: estimates[0]},
                "indistinguishable_from": [name for name, _ in causes[1:]],
                "separating_experiment": None,
                "explanations": [
                    {"cause": name, "numbers": {name: {parameter: estimate}}}
                    for (name, parameter), estimate in zip(causes, estimates, strict=True)
                ],
            }
        ],
    }
    (folder / "diagnosis.json").write_text(json.dumps(table), encoding="utf-8")
    (folder / "model.toml").write_text(
        '[actuator]\nkind = "ideal"\ngain = 4.2\nspool_radius = 0.0125\n', encoding="utf-8"
    )
