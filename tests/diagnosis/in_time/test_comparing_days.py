"""Days as a user names them: a dataset, a folder of datasets, an earlier answer."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tendon_newton.cli import main as run
from tendon_newton.data.dataset import listed_files
from tendon_newton.data.recording import Recording
from tendon_newton.diagnosis.in_time.changes import for_each_servo
from tests.effect_bench import commanded
from tests.held_out import said, small_dataset
from tests.physics.runs import ideal_model


def test_a_folder_of_days_gives_every_number_its_course(tmp_path: Path) -> None:
    """Two days by their names: a page with a course for each number, and the last day's model."""
    first = small_dataset(tmp_path / "first")
    for day in ("2026-03-02", "2026-03-01"):
        shutil.copytree(first, tmp_path / "days" / day)
    out = tmp_path / "out"
    printed = said(["diagnose", tmp_path / "days", "--against", first, "--out", out])
    answer = json.loads((out / "changes.json").read_text())
    assert list(answer["days"]) == ["2026-03-01", "2026-03-02"]
    assert [day["next_steps"] for day in answer["days"].values()] == [[], []]
    assert "2026-03-02: Nothing has changed" in printed
    page = (out / "changes.html").read_text()
    numbers = answer["days"]["2026-03-01"]["numbers"]
    assert page.count("<figure>") == len(numbers) > 5
    assert "viscous_friction" in (out / "model.toml").read_text()  # what both days lacked
    assert {number["cause"] for number in numbers} >= {"tendon_slack", "viscous_friction"}


def test_the_doctor_holds_one_recording_against_a_day(tmp_path, capsys) -> None:
    """The same recording: nothing to mend; one that a dataset does not list is one line."""
    first = small_dataset(tmp_path / "first")
    file, *_ = listed_files(first)
    assert run(["doctor", str(first / file), "--against", str(first)]) == 0
    assert f"{file}: Nothing has changed" in capsys.readouterr().out
    shutil.copy(first / file, first / "other.csv")
    assert run(["doctor", str(first / "other.csv"), "--against", str(first)]) == 2
    assert "dataset.toml must list it" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (
            ["{here}/none", "--against", "{here}/first"],
            "neither dataset.toml nor a folder with one",
        ),
        (["{here}/first", "--against", "{here}"], "neither dataset.toml nor diagnosis.json"),
        (["{here}/first", "--against", "{here}/bare"], "name one with --model"),
        (["{here}/first", "--against", "{here}/first", "--budget", "1min"], "takes no --hold-out"),
    ],
)
def test_days_that_are_none_are_one_line(words, says, tmp_path, capsys) -> None:
    """What was expected, what came, and where."""
    small_dataset(tmp_path / "first")
    (small_dataset(tmp_path / "bare") / "model.toml").unlink()
    shown = [word.format(here=tmp_path) for word in words]
    assert run(["diagnose", *shown, "--out", str(tmp_path / "out")]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert says in line


def two_servos() -> Recording:
    """A finger between two strings that rests."""
    one = commanded(np.zeros(80), bench="finger_antagonist")
    assert one.command is not None
    signals = ("command", "motor_position", "motor_velocity")
    return replace(one, **{name: np.zeros((80, 2)) for name in signals})


def test_each_servo_has_its_own_number_of_what_all_share() -> None:
    """Slack of all servos becomes slack of each, what is of one stays, a bench has one tilt."""
    model = ideal_model(tendon_slack={"length": 0.001}, gravity_misalignment={"angle": 0.1})
    own = replace(ideal_model(tendon_slack={"length": 0.003}).effects[0], servo=1)
    out = for_each_servo(replace(model, effects=(*model.effects, own)), [two_servos()])
    found = {effect.cause: effect.values for effect in out.effects}
    assert found == {
        "tendon_slack of servo 0": {"length": 0.001},
        "tendon_slack of servo 1": {"length": 0.003},
        "gravity_misalignment": {"angle": 0.1},
    }
