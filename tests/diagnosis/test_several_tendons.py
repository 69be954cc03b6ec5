"""Recordings of several tendons are diagnosed with all their signals, or refused at once."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tendon_newton.cli import main
from tendon_newton.data.dataset import write_dataset
from tendon_newton.data.model_file import Model, NamedValues
from tendon_newton.data.recording import Recording
from tendon_newton.data.servo_names import name_of
from tendon_newton.diagnosis.explanation import Setting
from tendon_newton.diagnosis.next_experiment.expected_run import Forecast
from tendon_newton.diagnosis.next_experiment.open_sets import OpenSets
from tendon_newton.diagnosis.next_experiment.planned_runs import blank_recording, library_plans
from tendon_newton.diagnosis.next_experiment.run_design import usual_task
from tendon_newton.diagnosis.next_experiment.run_files import write_command
from tendon_newton.diagnosis.posterior import Coordinate, FittedSet, OpenNumber, Posterior
from tendon_newton.diagnosis.report_words import with_owner
from tendon_newton.diagnosis.search.coordinates import atoms
from tendon_newton.diagnosis.search.floors import floors_of
from tendon_newton.diagnosis.search.refit import Fit, start_fits
from tendon_newton.diagnosis.search.search_worlds import SearchWorlds
from tendon_newton.diagnosis.search.survey import look_around
from tendon_newton.effects import EFFECTS, are_one_law, are_related, special_cases
from tendon_newton.errors import InvalidModelFile
from tendon_newton.identification import testable
from tendon_newton.identification.noise_floor import NoiseFloor
from tendon_newton.identification.objective import layout
from tendon_newton.identification.study import Study, replacements
from tests.bad_input.damage import refusal
from tests.importers.logs import model, recording

SIGNALS = ("force", "command", "motor_position", "motor_velocity")
TWO = {"bench": "finger_antagonist"} | {
    name: np.full((20, 2), 2.0 if name == "force" else 0.5) for name in SIGNALS
}
FOUR = {"bench": "hand"} | {name: np.tile(TWO[name], 2) for name in SIGNALS}
NARROW: dict[str, Any] = {name: TWO[name][:, :1] for name in SIGNALS}


def answer(verb: str, tmp_path: Path, train: Recording, test: Recording) -> int:
    """Diagnose or simulate two recordings from the command line; return its exit status."""
    write_dataset(tmp_path / "data", [train], [test])
    words = ["--model", str(model(tmp_path / "model.toml")), "--out", str(tmp_path / "out")]
    return main([verb, str(tmp_path / "data"), *words])


@pytest.mark.parametrize("several", ["train", "test"])
def test_recordings_with_different_numbers_of_tendons_are_refused(
    several: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """One line names both benches and how many servos each has, before anything is compiled."""
    train, test = (
        recording(f"{name}.csv", **(TWO if name == several else {})) for name in ("train", "test")
    )
    assert answer("diagnose", tmp_path, train, test) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "test.csv: recordings to be diagnosed or fitted together have as many servos" in line
    assert {"finger_antagonist has 2", "finger has 1"} == {
        f"{bench} has {n}" for bench, n in (("finger_antagonist", 2), ("finger", 1))
        if f"{bench} has {n}" in line
    }  # fmt: skip


@pytest.mark.parametrize("verb", ["diagnose", "simulate"])
def test_a_recording_of_one_of_two_servos_is_refused(verb, tmp_path, capsys) -> None:
    """Half of a bench is no recording of it."""
    train, test = (recording(f"{name}.csv", **(TWO | NARROW)) for name in ("train", "test"))
    assert answer(verb, tmp_path, train, test) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.endswith("has the servos of its bench; finger_antagonist has 2, and this one 1")


@pytest.mark.parametrize(
    ("column", "words"),
    [
        ("force_2", "'force' must be indexed from 0 without gaps; came force_0, force_1, force_3"),
        ("force_3", "column 'force_3' is missing"),
    ],
)
def test_a_hands_recording_that_lacks_a_force_is_refused(column, words, tmp_path, capsys) -> None:
    """One line names the file and the column."""
    train, test = (recording(f"{name}.csv", **FOUR) for name in ("train", "test"))
    write_dataset(tmp_path / "data", [train], [test])
    file = tmp_path / "data" / "train.csv"
    rows = [line.split(",") for line in file.read_text().splitlines()]
    place = rows[0].index(column)
    file.write_text("".join(",".join(row[:place] + row[place + 1 :]) + "\n" for row in rows))
    options = ["--model", str(model(tmp_path / "model.toml")), "--out", str(tmp_path / "out")]
    line = refusal(["diagnose", str(tmp_path / "data"), *options], capsys)
    assert line.startswith("error: train.csv")
    assert words in line


def study_of(recordings: list[Recording], effects: tuple[str, ...], *known: NamedValues) -> Study:
    """Compare recordings with the ideal servo."""
    actuator = NamedValues(name="ideal", values={"gain": 4.2})
    start = Model(actuator=actuator, effects=known)
    return Study(recordings, start, effects, time_step=1e-3)


OWN = ("gain_error of servo 0", "gain_error of servo 1")
EFFECTS_HERE = ("gain_error", "load_cell_bias", "joint_stiffness_error")


def test_every_servo_has_signals_and_causes_of_its_own() -> None:
    """Angle and force of each count apart, in the same blocks of the same whole recording."""
    study = study_of([recording(f"{n}.csv", **TWO) for n in "ab"], EFFECTS_HERE)
    assert [r.name for r in study.recordings] == [
        f"{name}.csv, servo {servo}" for name in "ab" for servo in (0, 1)
    ]
    where = layout(study)
    assert [(signal, int(rows.sum())) for signal, rows in where.signals] == [
        (signal, 40) for _ in (0, 1) for signal in ("theta", "force")
    ]
    assert where.block_count == 2  # a quarter of a second each
    for _, rows in where.signals:
        assert where.recording[rows].tolist() == [0] * 20 + [1] * 20
        assert where.block[rows].tolist() == [0] * 20 + [1] * 20
    names = testable.testable_effects(study)
    assert {n for n in names if n.startswith("gain_error")} == {
        "gain_error", "gain_error of servo 0", "gain_error of servo 1",
    }  # fmt: skip
    # a cell is one servo's; joints are nobody's, and nothing here reads their encoders
    assert {n for n in names if n.startswith("load_cell_bias")} == {
        "load_cell_bias of servo 0", "load_cell_bias of servo 1",
    }  # fmt: skip
    assert [n for n in names if n.startswith("joint")] == [
        name
        for name, effect in EFFECTS.items()
        if name.startswith("joint") and not effect.further_signals()
    ]


def test_every_finger_of_a_hand_has_causes_of_its_own() -> None:
    """Its joints' too; one base and one clock belong to all, and joints have names of their own."""
    effects = ("joint_stiffness_error", "gravity_misalignment", "sample_period_error")
    actuator = NamedValues(name="ideal", values={"gain": 4.2})
    study = Study(
        [recording("a.csv", **FOUR)], Model(actuator=actuator), effects,
        time_step=1e-3, tolerant=True,
    )  # fmt: skip
    named = {owner for owner, _ in study.table.owners} & set(testable.testable_effects(study))
    stiff = {name_of("joint_stiffness_error", servo) for servo in (None, 0, 1, 2, 3)}
    assert named == stiff | {"gravity_misalignment", "sample_period_error"}
    numbers = [number.name for number in study.tolerated]
    assert numbers[:4] == ["mass_mcp_0", "mass_pip_0", "mass_dip_0", "mass_mcp_1"]
    assert len(set(numbers)) == 12
    own = study.table.column("joint_stiffness_error of servo 2", "scale")
    mass = study.table.column("bench", "mass_pip_3")
    found = study.residuals(*replacements([{}, {own: 1.5}, {mass: 0.02}]))
    for servo, residual in enumerate(found):
        for n, moved in ((1, 2), (2, 3)):
            assert np.array_equal(residual.theta[0], residual.theta[n]) == (servo != moved)


def test_a_residual_is_that_of_its_own_servo() -> None:
    """A bias of one cell moves that cell's residual and no other signal, by what it is."""
    study = study_of([recording("a.csv", **TWO)], EFFECTS_HERE)
    column = study.table.column("load_cell_bias of servo 1", "offset")
    first, second = study.residuals(*replacements([{}, {column: 0.3}]))
    for residual, moved in ((first, 0.0), (second, -0.3)):
        assert np.array_equal(residual.theta[0], residual.theta[1])
        assert residual.force[1] - residual.force[0] == pytest.approx(moved, abs=1e-12)


def test_what_is_said_of_all_servos_is_said_of_each_that_has_none_of_its_own() -> None:
    """One column for both, two columns, and one beside the other give the same simulation."""
    study = study_of([recording("a.csv", **TWO)], EFFECTS_HERE)
    both, *own = (
        study.table.column(name, "scale")
        for name in ("gain_error", "gain_error of servo 0", "gain_error of servo 1")
    )
    models = [{both: 0.7}, dict.fromkeys(own, 0.7), {both: 0.7, own[1]: 1.3}]
    found = study.residuals(*replacements([*models, {own[0]: 0.7, own[1]: 1.3}]))
    for residual in found:
        assert np.array_equal(residual.theta[0], residual.theta[1])
        assert np.array_equal(residual.theta[2], residual.theta[3])
        assert not np.array_equal(residual.theta[0], residual.theta[2])


def test_a_starting_model_may_say_what_one_servo_has() -> None:
    """Its numbers stand in that servo's columns, and it counts as known."""
    known = NamedValues(name="gain_error", servo=1, values={"scale": 0.8})
    study = study_of([recording("a.csv", **TWO)], EFFECTS_HERE, known)
    assert study.known == ("gain_error of servo 1",)
    values = [
        study.base_value(study.table.column(f"gain_error of servo {d}", "scale")) for d in (0, 1)
    ]
    assert values == [1.0, 0.8]
    with pytest.raises(InvalidModelFile, match=r"servo of effect 'gain_error'.*0 to 1; it is 2"):
        study_of(
            [recording("a.csv", **TWO)], EFFECTS_HERE,
            NamedValues(name="gain_error", servo=2, values={"scale": 0.8}),
        )  # fmt: skip


def test_a_survey_adds_up_what_each_servo_does() -> None:
    """The direction of both servos is the sum of two; where one is in the fit, that of the other.

    A quarter more gain of both differs from that sum by less than a tenth of it.
    """
    moving = {n: np.linspace([1.0, 0.5], [2.0, 1.0], 20) for n in ("command", "motor_position")}
    worlds = SearchWorlds(study_of([recording("a.csv", **(TWO | moving))], EFFECTS_HERE))
    names = ("gain_error", *OWN)
    floors = floors_of(worlds, ())
    empty, one = start_fits(
        worlds, [((), {}), ((OWN[1],), {worlds.study.table.column(OWN[1], "scale"): 1.2})], floors
    )
    both, *own = (directions(worlds, empty, names)[name] for name in ("gain_error", *OWN))
    assert np.array_equal(both, own[0] + own[1])
    scale = worlds.study.table.column("gain_error", "scale")
    size = atoms(worlds.study, "gain_error")[0]
    moved = worlds.residuals([{scale: size[scale]}])[0] - empty.residual
    assert np.linalg.norm(both[0] - moved) < 0.1 * np.linalg.norm(moved)
    beside = directions(worlds, one, names)
    assert OWN[1] not in beside
    assert beside["gain_error"] == pytest.approx(beside[OWN[0]], abs=1e-9)


def directions(worlds: SearchWorlds, fit: Fit, names: tuple[str, ...]) -> dict[str, np.ndarray]:
    """Return how residuals change as each effect appears at each typical size, shape (A, M)."""
    columns, changes = look_around(worlds, fit, names)
    found = [c.name for c in columns if c.kind == "atom"]
    return {
        n: changes[[i for i, own in enumerate(found) if own == n]] for n in dict.fromkeys(found)
    }


def test_each_servo_moves_in_turn_while_the_others_hold() -> None:
    """The library's runs of an antagonist, as a command file and as a recording to simulate."""
    plans = library_plans([Setting(bench="finger_antagonist")], (0,), 4.0)
    assert {(plan.servo, plan.servos) for plan in plans} == {(0, 2), (1, 2)}
    for plan in plans:
        commands = blank_recording(plan, has_force=True).command
        assert (commands[:, plan.servo] == plan.command).all()
        assert (commands[:, 1 - plan.servo] == 0.0).all()
    assert plans[-1].place == "finger_antagonist, servo 1 moving"


def test_a_run_tells_of_the_servo_that_moves(tmp_path: Path) -> None:
    """What one finger of a hand does tells nothing of the friction at another's servo."""
    cause = NamedValues(name="viscous_friction", values={"coefficient": 1.0}, servo=1)
    ideal = NamedValues(name="ideal", values={"gain": 4.2, "spool_radius": 0.0125})
    hand = Setting(bench="hand")
    scale = Coordinate(kind="linear", origin=0.0, unit=1.0, lower=0.0, upper=20.0)
    number = OpenNumber(owner=cause.cause, name="coefficient", coordinate=scale, place=1.0)
    own = FittedSet(
        weight=1.0, causes=(cause.cause,), numbers=(number,), covariance=np.array([[100.0]])
    )
    question = OpenSets(
        posterior=Posterior(sets=(own,)),
        model=Model(actuator=ideal, effects=(cause,)),
        noise=NoiseFloor(theta=0.00044, force=0.05),
    )
    forecast = Forecast(question, usual_task(hand, 2.0), 1.0 / 80.0)
    plans = [plan for plan in library_plans([hand], (0,), 2.0) if plan.excitation == "ramps"]
    told = {e.plan.servo: sum(e.told.numbers.values()) for e in forecast.runs(plans)}
    assert told[1] > 2.0
    assert all(bits == pytest.approx(0.0, abs=1e-6) for d, bits in told.items() if d != 1)
    write_command(tmp_path / "run.csv", plans[1])
    head, *rows = (tmp_path / "run.csv").read_text(encoding="utf-8").splitlines()
    assert head.startswith("t,theta_d_0,theta_d_1,")
    assert all(row.split(",")[1] == "0.000000" for row in rows)


def test_only_one_of_a_law_may_act_at_a_servo() -> None:
    """A law of all servos and that of one exclude each other; those of two servos do not."""
    one, other = "coulomb_friction of servo 0", "coulomb_friction of servo 1"
    assert are_one_law("coulomb_friction", one)
    assert not are_one_law(one, other)
    assert not are_one_law(one, one)
    assert are_related("stribeck_friction", other)
    assert are_related("stribeck_friction of servo 1", other)
    assert not are_related("stribeck_friction of servo 1", one)
    assert special_cases("stribeck_friction of servo 1") == (other,)


def test_a_cause_is_told_with_its_owner() -> None:
    """One servo's says so itself; that of all says so where there are several."""
    assert with_owner("gain_error of servo 1", 2) == "gain_error of servo 1"
    assert with_owner("gain_error", 2) == "gain_error of both servos"
    assert with_owner("gain_error", 5) == "gain_error of all 5 servos"
    assert with_owner("gain_error", 1) == "gain_error"
    assert with_owner("joint_stiffness_error", 2) == "joint_stiffness_error"
