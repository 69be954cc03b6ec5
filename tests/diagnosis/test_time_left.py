"""A diagnosis says before it starts what it will take, and can be ended early with an answer."""

import inspect
import json
import re
from collections.abc import Callable
from dataclasses import replace
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tendon_newton.cli import main
from tendon_newton.cli.diagnosis import diagnose as verb
from tendon_newton.cli.diagnosis.diagnose import limit_cores, summary
from tendon_newton.cli.duration import read_duration
from tendon_newton.data.dataset import load_dataset, write_dataset
from tendon_newton.data.model_file import load_model
from tendon_newton.diagnosis import diagnose as diagnosing
from tendon_newton.diagnosis import time_left as timing
from tendon_newton.diagnosis.report_words import headline
from tendon_newton.diagnosis.search.decide import decision
from tendon_newton.diagnosis.search.decide import find_causes as finding
from tendon_newton.diagnosis.search.decide.extent import SEARCHED_SECONDS, Limits, limits_of
from tendon_newton.diagnosis.search.decide.find_causes import find_causes
from tendon_newton.diagnosis.time_left import (
    expected_times,
    finishing_time,
    measured_pace,
    nearly_alike,
    time_left,
)
from tendon_newton.errors import InvalidParameter
from tendon_newton.identification.study import Study, replacements
from tendon_newton.scheduler import THREADS_VARIABLE
from tendon_newton.workflows import diagnosing as writing
from tests.diagnosis.made_up import EXAMPLE, beginning, diagnosis, evidence
from tests.effect_bench import commanded

EFFECTS = ("viscous_friction", "command_delay")


@pytest.mark.parametrize(
    ("text", "seconds"),
    [("90s", 90.0), ("5min", 300.0), ("1h", 3600.0), ("45", 45.0), ("1.5 min", 90.0)],
)
def test_a_time_is_read_as_a_person_types_it(text: str, seconds: float) -> None:
    """Seconds, minutes and hours."""
    assert read_duration(text, "--budget") == seconds


@pytest.mark.parametrize("text", ["", "soon", "-5min", "0", "5 minutes", "nan", "1e9999"])
def test_what_is_no_time_is_refused(text: str) -> None:
    """The option and what came are named."""
    with pytest.raises(InvalidParameter, match="--budget must be a time"):
        read_duration(text, "--budget")


def test_the_time_told_grows_with_the_data_and_the_causes(monkeypatch: pytest.MonkeyPatch) -> None:
    """A clock that ticks once in the trial: five times the data are five times the time."""
    ticks = count()
    monkeypatch.setattr(timing.time, "monotonic", lambda: float(next(ticks)))
    dataset, model = load_dataset(EXAMPLE), load_model(EXAMPLE / "model.toml")
    recordings = [beginning(r, force=True) for r in dataset.train if r.bench == "spring_weak"]
    study = Study(recordings, model, EFFECTS, time_step=5e-4)
    pace = measured_pace(recordings, model, study)
    one, several = expected_times(recordings[:1], study, pace)
    more, _ = expected_times(recordings[:1] * 5, study, pace)
    assert 0.0 < one < several
    assert more == pytest.approx(5.0 * one)


def test_every_candidate_that_is_timed_is_simulated() -> None:
    """Equal candidates share a world: a clock would then show a fraction of the time."""
    model = load_model(EXAMPLE / "model.toml")
    runs = [r for r in load_dataset(EXAMPLE).train if r.bench == "spring_weak"]
    recordings = [beginning(r, force=True) for r in runs]
    study = Study(recordings, model, EFFECTS, time_step=2e-3)
    candidates = nearly_alike(study, {study.table.columns("command_delay")[0]: 0.03}, 5)
    found = study.residuals(*replacements(candidates))[0].theta
    assert len(np.unique(found, axis=0)) == 5
    assert found == pytest.approx(np.tile(found[0], (5, 1)), abs=1e-6)


def test_time_is_kept_for_what_follows_the_decision() -> None:
    """Figures take their time; simulated are all training rows, and test rows more finely."""
    whole = load_dataset(EXAMPLE)
    none, some = (finishing_time(whole, pace) for pace in (0.0, 1e-3))
    more = finishing_time(replace(whole, test=whole.test * 2), 1e-3)
    assert 5.0 < none < some < more
    assert more - some == pytest.approx(0.028 * sum(r.duration for r in whole.test))


def test_time_left_follows_from_what_is_done() -> None:
    """Three fifths have passed when the tests begin; before that nobody knows."""
    assert time_left("looking at 42 effects", 3.0) == ""
    assert time_left("testing viscous_friction", 30.0) == ", about 20 s left"
    assert time_left("measuring the gain", 190.0) == ", about 10 s left"


def test_every_stage_that_has_a_share_is_told() -> None:
    """A message that is worded anew would lose its time left: they stand in the sources."""
    texts = inspect.getsource(find_causes) + Path(diagnosing.__file__).read_text()
    for begin, _ in timing.DONE:
        assert re.search(rf'progress\(f?"{begin}', texts), begin


def stopped(at: str) -> Callable[[str], None]:
    """Progress that presses Ctrl-C once at a stage."""
    pressed = []

    def progress(text: str) -> None:
        if text.startswith(at) and not pressed:
            pressed.append(text)
            raise KeyboardInterrupt

    return progress


def search(**options: Any) -> Any:
    """Search the example's springs for two effects."""
    dataset, model = load_dataset(EXAMPLE), load_model(EXAMPLE / "model.toml")
    recordings = [beginning(r, force=True) for r in dataset.train if r.bench == "spring_weak"]
    study = Study(recordings, model, EFFECTS, time_step=1e-3)
    return find_causes(recordings, study, model, EFFECTS, **options)


def test_an_interrupted_search_gives_what_it_has() -> None:
    """The friction was found before the interrupt: it is named, and the search is unfinished."""
    found = search(progress=stopped("testing"))
    assert not found.finished
    assert found.final.effects == ("viscous_friction",)
    assert "stopped before its end" in " ".join(found.notes)


def test_a_budget_that_is_over_gives_an_answer_that_is_unfinished() -> None:
    """Nothing was looked for: no cause is named, and the answer says why."""
    found = search(budget=0.0)
    assert not found.finished
    assert found.final is None
    assert "budget of time" in " ".join(found.notes)


def over_when_deciding(*_: Any, **__: Any) -> Limits:
    """Limits of a search that takes all the time there is."""
    return Limits(searched=np.inf, decided=-np.inf, beginnings=SEARCHED_SECONDS, decides_apart=True)


def test_what_was_not_tested_in_time_is_not_named(monkeypatch: pytest.MonkeyPatch) -> None:
    """The search has ended, and no refit without a part could be made: the friction is open."""
    monkeypatch.setattr(finding, "limits_of", over_when_deciding)
    monkeypatch.setattr(decision, "SURE", np.inf)
    found = search()
    assert not found.finished
    assert found.final is None
    assert any(
        note.startswith("Found, and not named, since the time was over")
        and note.endswith(": viscous_friction.")
        for note in found.notes
    )


def test_what_is_sure_without_such_refits_is_named_though_time_is_over(monkeypatch) -> None:
    """The friction is worth many bars even on what its absence was fitted to."""
    monkeypatch.setattr(finding, "limits_of", over_when_deciding)
    found = search()
    assert found.finished
    assert found.final.effects == ("viscous_friction",)


def test_less_time_is_less_that_is_searched_and_decides() -> None:
    """Plenty: all that may decide does. Then beginnings are shorter; at last they decide."""
    data = [commanded(np.zeros(80 * 30), "spring_weak") for _ in range(20)]
    unlimited, plenty, some, little = (
        limits_of(budget, 1e-3, data) for budget in (None, 1e4, 120.0, 30.0)
    )
    for limits in (unlimited, plenty):
        assert limits.decides_apart
        assert limits.beginnings == SEARCHED_SECONDS
    # six tenths of 120 s are for 2,300 candidates, of which each takes 1 ms for a second
    assert some.decides_apart
    assert some.beginnings == pytest.approx(72.0 / 2.3)
    assert not little.decides_apart
    assert little.beginnings == pytest.approx(18.0 / 2.3)
    few = limits_of(30.0, 1e-3, data[:1])  # all of 30 s are affordable
    assert few.decides_apart
    assert unlimited.searched == unlimited.decided == np.inf
    assert little.decided - little.searched == pytest.approx(12.0)


def test_a_second_interrupt_ends_it() -> None:
    """While all rows are decided on, Ctrl-C is Ctrl-C."""
    with pytest.raises(KeyboardInterrupt):
        search(progress=stopped("deciding"))


def test_unfinished_is_said_first_on_page_screen_and_file() -> None:
    """Nobody takes it for the whole answer."""
    found = replace(diagnosis("explained"), finished=False)
    assert headline(found).startswith("Unfinished search. So far: one cause accounts")
    assert summary(found).lstrip().startswith("UNFINISHED")
    assert found.to_json()["finished"] is False
    assert diagnosis("explained").to_json()["finished"] is True


def test_cores_are_limited_within_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    """The number reaches the simulation; none below one."""
    monkeypatch.setenv(THREADS_VARIABLE, "7")
    limit_cores(None)
    assert verb.os.environ[THREADS_VARIABLE] == "7"
    limit_cores(2)
    assert verb.os.environ[THREADS_VARIABLE] == "2"
    with pytest.raises(InvalidParameter, match="--jobs must be 1 to"):
        limit_cores(0)


def test_json_alone_stands_on_the_output(tmp_path, monkeypatch, capsys) -> None:
    """A program reads the output; progress and a gap in the data are on the error stream."""
    whole = load_dataset(EXAMPLE)
    first = whole.train[0]
    rows = np.r_[0:100, 200:400]
    broken = replace(
        first,
        time=first.time[rows],
        command=first.command[rows],
        motor_position=first.motor_position[rows],
        motor_velocity=first.motor_velocity[rows],
        force=first.force[rows],
        enabled=first.enabled[rows],
        tip=None,
    )
    write_dataset(tmp_path / "data", [broken], [beginning(whole.test[0], force=True)])

    def answer(*_: Any, progress: Callable[[str], None], budget: float | None) -> Any:
        progress("testing viscous_friction")
        assert budget is not None
        assert 100.0 < budget < 120.0  # the command read its data first
        return diagnosis("explained"), evidence()

    monkeypatch.setattr(writing, "diagnose", answer)
    words = ["diagnose", str(tmp_path / "data"), "--model", str(EXAMPLE / "model.toml")]
    words += ["--out", str(tmp_path / "out"), "--json", "--budget", "2min"]
    assert main(words) == 0
    out, err = capsys.readouterr()
    assert json.loads(out)["verdict"] == "explained"
    assert "testing viscous_friction, about" in err
    assert "1 gaps" in err
    assert "commands sent within a gap are unknown" in err
