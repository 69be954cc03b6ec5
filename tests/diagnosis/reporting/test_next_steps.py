"""Where a gap is left the answer says what came closest, what stopped it, and what to do."""

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tendon_newton.cli.diagnosis.diagnose import summary
from tendon_newton.data.dataset import Dataset, load_dataset
from tendon_newton.data.model_file import load_model, write_model
from tendon_newton.data.recording import Recording
from tendon_newton.diagnosis.accounts.next_steps import (
    GO_ON,
    better_start,
    came_closest,
    next_steps,
    to_record,
    what_apart,
)
from tendon_newton.diagnosis.accounts.suspect_data import plainly_wrong, standing_apart
from tendon_newton.diagnosis.explanation import Setting
from tendon_newton.diagnosis.reporting.report import write_report
from tendon_newton.diagnosis.result import CandidateScore, Criterion, Errors
from tendon_newton.diagnosis.search.decide.account import ADDED, TOGETHER
from tendon_newton.errors import InvalidModelFile
from tendon_newton.identification.study import Study
from tests.diagnosis.made_up import COEFFICIENT, EXAMPLE, beginning, diagnosis, evidence
from tests.made import stated_model

BENCHES = ("spring_weak", "spring_strong", "finger")
KILOGRAM_FORCE = 0.102  # [kgf] in one newton


def springs() -> list[Recording]:
    """Beginnings of the example's recordings of springs, five of them."""
    dataset = load_dataset(EXAMPLE)
    every = (*dataset.train, *dataset.test)
    return [beginning(r, force=True) for r in every if r.bench.startswith("spring")]


def told(recordings: Sequence[Recording], gain: float = 4.2) -> list[str]:
    """Return what is suspect of recordings, under the model that is right for the bench."""
    model = load_model(EXAMPLE / "model.toml")
    actuator = replace(model.actuator, values={**model.actuator.values, "gain": gain})
    model = replace(model, actuator=actuator)
    study = Study(recordings, model, ("viscous_friction",), time_step=1e-3)
    (column,) = study.table.columns("viscous_friction")
    apart = standing_apart(study, model, {column: COEFFICIENT}, BENCHES)
    return [suspect.text for suspect in (*plainly_wrong(study, model), *apart)]


def test_good_data_are_not_suspect() -> None:
    """Five recordings of two springs, as they were made."""
    assert told(springs()) == []


def test_a_force_in_another_unit_is_called_that() -> None:
    """The one in kgf is named, with the unit; the others are not."""
    first, *others = springs()
    said = told([replace(first, force=KILOGRAM_FORCE * first.force), *others])
    unit = [text for text in said if "kgf in place of N?" in text]
    assert len(unit) == 1
    assert unit[0].startswith(f"{first.name}: force is")
    whole = [replace(r, force=KILOGRAM_FORCE * r.force) for r in springs() if r.force is not None]
    (said_once,) = told(whole)[:1]
    assert re.match(rf"{first.name} and [34] more recordings: force is", said_once)


def test_an_angle_behind_a_gear_is_called_that() -> None:
    """A tenth of the spool's, or ten times it; the force says that the spool turned as far."""
    for gear in (0.1, 10.0):
        geared = [replace(r, motor_position=gear * r.motor_position) for r in springs()]
        (said,) = [text for text in told(geared) if "not that of the spool" in text]
        times, back = re.findall(r"(?:theta is|scale =) ([\d.]+)", said)
        assert float(times) == pytest.approx(gear, rel=0.25)
        assert float(back) == pytest.approx(1.0 / gear, rel=0.25)


def test_something_in_the_way_is_no_gear() -> None:
    """It shortens the way of most recordings to a quarter; a gear would have shortened all."""
    first, *others = springs()
    short = [replace(r, motor_position=0.25 * r.motor_position) for r in others]
    assert not any("not that of the spool" in text for text in told([first, *short]))


def test_a_gain_of_another_unit_is_seen_at_rest() -> None:
    """4.2 N/rad stated as N m/rad is 80 times too small: force against command minus angle tells.

    A servo that gives half or twice of what is stated is a cause to be found.
    """
    (said,) = [text for text in told(springs(), 4.2 * 0.0125) if "not that of the data" in text]
    assert float(re.findall(r"grows by ([\d.]+) times", said)[0]) == pytest.approx(80.0, rel=0.3)
    assert "N m/rad in place of N/rad" in said
    assert any("not that of the data" in text for text in told(springs(), 57.3 * 4.2))
    with pytest.raises(InvalidModelFile, match="gain of actuator 'ideal' must be between"):
        told(springs(), 4.2 / 0.0125)
    for gain in (2.1, 8.4):
        assert not any("not that of the data" in text for text in told(springs(), gain))


def test_a_recording_of_another_bench_is_found_with_its_bench() -> None:
    """A strong spring that its entry calls a weak one stands apart, and fits where it belongs."""
    weak = [r for r in springs() if r.bench == "spring_weak"]
    strong = next(r for r in springs() if r.bench == "spring_strong")
    (said,) = told([*weak, replace(strong, bench="spring_weak")])
    assert said.startswith(f"{strong.name} stands apart")
    assert "As a recording of spring_strong it fits" in said
    assert "its entry in dataset.toml says spring_weak" in said


def test_two_runs_that_contradict_each_other_are_both_named() -> None:
    """The same command on the same bench, 50 mrad apart."""
    first, *others = springs()
    moved = replace(first, name="again.csv", motor_position=first.motor_position + 0.05)
    said = [text for text in told([first, moved, *others]) if "contradict" in text]
    assert len(said) == 1
    assert said[0].startswith(f"{first.name} and again.csv have the same bench")
    assert "differ by 50.0 mrad" in said[0]


def test_an_error_that_comes_at_times_is_told_with_its_time() -> None:
    """Three knocks of a tenth of a second in one recording of five, the greatest after 2.5 s."""
    first, *others = springs()
    moved = np.array(first.motor_position)
    for row, size in ((100, 0.2), (200, 0.3), (300, 0.2)):
        moved[row : row + 8] += size
    (said,) = told([replace(first, motor_position=moved), *others])
    assert said.startswith(
        f"The error comes at times: in {first.name}, 10 % of the rows hold 100 % of the squared"
    )
    assert "most of it about t = 2.5 s" in said


@pytest.mark.parametrize("at_start", [False, True])
def test_an_error_at_jumps_of_the_command_is_no_knock(*, at_start: bool) -> None:
    """A servo that answers a step otherwise errs after it, and a log's first rows are a step's."""
    steps = next(r for r in springs() if "steps" in r.name)
    assert steps.command is not None
    (jump,) = np.flatnonzero(np.abs(np.diff(steps.command[:, 0])) > 0.2) + 1
    first = 0 if at_start else jump
    moved = np.array(steps.motor_position)
    moved[first : first + 8] += 0.2
    others = [r for r in springs() if r.name != steps.name]
    said = told([replace(steps, motor_position=moved), *others])
    assert not [text for text in said if "knock" in text]


def test_the_set_that_came_closest_is_told_with_what_stopped_it() -> None:
    """45 % are left and at most 20 % may be."""
    stop = Criterion(name=TOGETHER, value=0.45, bar=0.2, passed=False)
    scores = (
        CandidateScore(name="command_delay", score=0.4, values={"delay": 0.02}, criteria=(stop,)),
        CandidateScore(name="backlash", score=0.5, values={"width": 0.1}, criteria=()),
    )
    (said,) = came_closest(replace(diagnosis("unexplained"), candidates=scores))
    assert said.startswith("command_delay 20.0 ms came closest")
    assert "45 % of the squared error above the noise is left, and at most 20 % may be" in said


def test_without_a_set_the_best_single_causes_are_told() -> None:
    """Those that explain a tenth or more, each with its reason."""
    refused = (Criterion(name=ADDED, value=0.05, bar=0.1, passed=False),)
    scores = (
        CandidateScore(
            name="speed_limit",
            score=0.82,
            values={"limit": 7.0},
            criteria=refused,
            acts_in=("steps.csv",),
            looked_at=5,
        ),
        CandidateScore(name="deadband", score=0.05, values={"width": 0.01}, criteria=refused),
    )
    (said,) = came_closest(replace(diagnosis("unexplained"), candidates=scores))
    assert "speed_limit 7.00 rad/s came close: it explains 82 % alone" in said
    assert "acts in 1 of 5 recordings" in said
    assert "What stopped it: residuals 5 % smaller; 10 % smaller asked" in said


@pytest.mark.parametrize("verdict", ["no_gap", "explained"])
def test_an_answer_without_a_gap_has_no_next_step(verdict: str) -> None:
    """Nothing is looked at where nothing is missing: the study is not even read."""
    found = diagnosis("no_gap") if verdict == "no_gap" else diagnosis("explained")
    nothing = Dataset(path=Path(), train=(), test=())
    shown = evidence()
    model = load_model(EXAMPLE / "model.toml")
    assert next_steps(found, nothing, model, shown.train, {}) == ()


def test_the_model_beside_the_recordings_is_offered_with_what_it_removes(tmp_path: Path) -> None:
    """A model of another kind of actuator that fits better, and none where it fits worse."""
    good = load_model(EXAMPLE / "model.toml")
    recordings = springs()[:1]
    dataset = Dataset(path=tmp_path, train=tuple(recordings), test=tuple(recordings))
    study = Study(recordings, good, ("viscous_friction",), time_step=1e-3)
    found = replace(
        diagnosis("unexplained"), baseline=Errors(force_rmse=9.0, theta_rmse=3.0, theta_mae=2.0)
    )
    servo = stated_model("pwm_servo")
    write_model(tmp_path / "model.toml", good)
    (said,) = better_start(dataset, servo, found, study)
    assert said.startswith(
        f"Your actuator is pwm_servo; model.toml beside the recordings says "
        f"{good.actuator.name}, which alone"
    )
    assert f"--model {tmp_path / 'model.toml'}" in said
    exact = replace(found, baseline=Errors(force_rmse=0.06, theta_rmse=0.001, theta_mae=0.001))
    assert list(better_start(dataset, servo, exact, study)) == []


def test_the_mode_of_a_collection_is_told_where_no_model_lies_beside_it(tmp_path: Path) -> None:
    """An ideal actuator for recordings in mode pwm."""
    ideal = stated_model("ideal", {"gain": 4.0})
    dataset = Dataset(path=tmp_path, train=(), test=())
    study = evidence().train
    assert list(better_start(dataset, ideal, diagnosis("unexplained"), study)) == []
    (tmp_path / "collection.toml").write_text('mode = "pwm"\n')
    (said,) = better_start(dataset, ideal, diagnosis("unexplained"), study)
    assert said.startswith("Your actuator is ideal; these were recorded in mode pwm")


def test_what_to_record_follows_from_what_is_missing() -> None:
    """No force, one bench, and the signal that the rest depends on."""
    found = diagnosis("unexplained")
    blind = replace(
        found,
        baseline=replace(found.baseline, force_rmse=None),
        recorded=(Setting(bench="finger", seconds=30.0),),
    )
    said = "\n".join(to_record(blind, what_apart(led=False, kinematic=False)))
    assert "Record the force" in said
    assert "All recordings are of finger" in said
    assert "depends most on theta: record slow ramps over the whole range" in said
    assert "Record the same commands on a second bench" in said
    assert "\n\n\n" not in summary(diagnosis("no_gap"))


def test_no_second_bench_is_asked_of_a_servo_alone_or_of_a_path_that_was_led() -> None:
    """A simulated servo without a mechanism has a load to leave out, and a led path no commands."""
    one, other = (what_apart(led=led, kinematic=True) for led in (False, True))
    assert one.startswith("Record the same commands without what the servo carries")
    assert other == ""


def test_where_nothing_comes_close_that_is_said() -> None:
    """The best single cause explains a hundredth."""
    scores = (CandidateScore(name="backlash", score=0.01, values={"width": 0.1}),)
    (said,) = came_closest(replace(diagnosis("unexplained"), candidates=scores))
    assert said.startswith("No effect of the catalogue explains 10 % of the gap alone")


def test_after_an_early_end_the_next_step_is_to_let_it_end() -> None:
    """Nothing is asked to be recorded, and no cause ruled out, before the search has looked."""
    scores = (CandidateScore(name="backlash", score=0.01, values={"width": 0.1}),)
    found = replace(diagnosis("unexplained"), finished=False, candidates=scores)
    shown, model = evidence(), load_model(EXAMPLE / "model.toml")
    nothing = Dataset(path=Path(), train=(), test=())
    assert next_steps(found, nothing, model, shown.train, shown.extended) == (GO_ON,)


def test_report_and_screen_tell_the_next_step(tmp_path: Path) -> None:
    """The same sentences on both."""
    found = replace(diagnosis("unexplained"), next_steps=("Do <this> first.",))
    write_report(tmp_path / "report.html", found, evidence())
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "What came closest, and what to do next" in page
    assert "<li>Do &lt;this&gt; first.</li>" in page
    assert "- Do <this> first." in summary(found)
    assert found.to_json()["next_steps"] == ["Do <this> first."]
