"""An investigation: what it writes, when it ends, and that it goes on where it stopped."""

import math
from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tendon_hardware.benches.bench import Bench, open_bench
from tendon_hardware.collection import collect_plan
from tendon_hardware.errors import BenchNotReady, SafetyStop
from tendon_hardware.stop_request import StopRequest
from tendon_newton.data.dataset import ListedRecording, list_recording, listed_files, load_dataset
from tendon_newton.diagnosis.explanation import Setting
from tendon_newton.diagnosis.next_experiment.investigation_log import (
    InvestigationLog,
    Step,
    read_log,
    with_answer,
    write_log,
)
from tendon_newton.diagnosis.next_experiment.planned_runs import plan_run
from tendon_newton.diagnosis.next_experiment.run_files import write_command
from tendon_newton.diagnosis.next_experiment.task_file import read_task
from tendon_newton.diagnosis.posterior import Posterior
from tendon_newton.errors import InvalidOutput, InvalidRecording, TendonNewtonError
from tendon_newton.workflows.investigating import investigation
from tendon_newton.workflows.investigating.investigation_check import binding, check
from tendon_newton.workflows.investigating.investigation_choice import (
    SPENT,
    choose_next,
    reason_to_end,
)
from tendon_newton.workflows.options import InvestigateOptions
from tests.diagnosis.next_experiment.test_experiment import OFFSET, TILT, sets_of, write_open_sets
from tests.faults import injections as on
from tests.faults.collecting import BEGIN
from tests.faults.injections import LONG, let
from tests.hardware.deploy.runs import at_instant
from tests.hardware.silent_operator import SilentOperator

STEP = Step(name="run_0", bench="finger", seconds=12.0, why="first")
QUIET = replace(STEP, verdict="no_gap", probabilities={})
OPEN = replace(STEP, probabilities={"a": 0.6})
OPTIONS = {"seed": 3, "benches": ["finger"]}


def test_a_log_is_read_as_it_was_written(tmp_path: Path) -> None:
    """Steps with commands, causes and an interval without end; a broken one is refused."""
    step = replace(
        STEP,
        command=(0.0, 1.5),
        expected={"names": 1.0, "task": 0.2},
        left={"names": 0.5, "task": 2.0},
        verdict="explained",
        probabilities={"a": 0.8},
        causes={"a": {"x": (1.0, 0.9, math.inf)}},
        by_hand="measure the spool",
    )
    log = InvestigationLog(options=OPTIONS, steps=(STEP, step), ended="done")
    path = tmp_path / "log.json"
    write_log(path, log)
    assert read_log(path, OPTIONS) == log
    path.write_text(path.read_text(encoding="utf-8").replace('"why"', '"what"'), encoding="utf-8")
    with pytest.raises(InvalidOutput, match="a step of the log is broken"):
        read_log(path, OPTIONS)
    path.write_text('{"schema": 2, "seed": 3, "steps": []}', encoding="utf-8")
    with pytest.raises(InvalidOutput, match="with the options that it was begun with"):
        read_log(path, OPTIONS)


def test_a_log_of_other_options_says_which_differ(tmp_path: Path) -> None:
    """Each option that differs, before and now, and none that does not."""
    path = tmp_path / "log.json"
    write_log(path, InvestigationLog(options=OPTIONS | {"known": None}, steps=(STEP,)))
    now = {"seed": 3, "benches": ["finger", "spring_weak"], "known": "model.toml"}
    with pytest.raises(InvalidOutput) as error:
        read_log(path, now)
    assert "begun with --benches finger, --known not given;" in str(error.value)
    assert "asked for is --benches finger spring_weak, --known model.toml:" in str(error.value)
    assert "--seed" not in str(error.value)


def test_half_a_spread_is_a_bit() -> None:
    """What came is read from what two answers leave: entropy of names, and spread of the task."""
    before = replace(STEP, left={"names": 1.5, "task": 4.0})
    after = replace(STEP, left={"names": 0.7, "task": 2.0})
    assert after.brought(before) == pytest.approx({"names": 0.8, "task": 1.0})
    assert after.brought(STEP) is None


def test_a_cause_is_as_likely_as_the_sets_that_hold_it() -> None:
    """The likeliest first, with the numbers of the likeliest set and their intervals."""
    step = with_answer(STEP, SETS, None)
    assert step.probabilities == {TILT[0]: 0.75, OFFSET[0]: 0.25}
    value, low, high = step.causes[TILT[0]][TILT[1]]
    assert (value, low, high) == pytest.approx((0.08, 0.07, 0.09), abs=1e-4)
    assert step.text() == "run_0: carried on, gravity_misalignment 75%, position_offset 25%"


@pytest.mark.parametrize(
    ("steps", "words"),
    [
        ((OPEN,), None),
        ((QUIET,), None),
        ((QUIET, QUIET), "nothing is left to explain, and a further run has not changed that"),
        ((OPEN, QUIET), None),
        ((replace(OPEN, seconds=50.0),), "the time at the bench is spent: 50 s were recorded"),
    ],
)
def test_it_ends_for_a_reason(steps: tuple[Step, ...], words: str | None) -> None:
    """And goes on as long as there is none."""
    log = InvestigationLog(options=OPTIONS, steps=steps)
    reason = reason_to_end(log, 61.0, 12.0)
    assert reason is None if words is None else str(reason).startswith(words)


SETS = sets_of((TILT, 0.75), (OFFSET, 0.25))


def diagnosing(monkeypatch: pytest.MonkeyPatch, killed: int | None = None) -> list[str]:
    """Let answers come from nowhere, and one of them be interrupted; return what was asked for."""
    asked: list[str] = []

    def ask(what: str, runs: int) -> None:
        asked.append(f"{what} {runs}")
        if len(asked) == killed:
            raise KeyboardInterrupt

    def answer(out: Path, dataset: Any, *_: Any, **__: Any) -> None:
        ask("diagnose", len(dataset.train))
        out.mkdir(exist_ok=True)
        write_open_sets(out, TILT, OFFSET)

    def carry(recordings: Any, _: Any, known: Posterior, **__: Any) -> Posterior:
        ask("carry on", len(recordings))
        return known

    monkeypatch.setattr(investigation, "diagnose_into", answer)
    monkeypatch.setattr(investigation, "go_on", carry)
    return asked


@pytest.mark.parametrize("killed", [1, 2, 3])
def test_it_goes_on_where_it_was_killed(killed, tmp_path, monkeypatch) -> None:
    """Sets are carried on from run to run, and the last answer is a diagnosis of all recordings.

    The call is killed in the first diagnosis, while sets are carried on, or in the last diagnosis:
    the next one repeats nothing that was recorded or answered.
    """
    asked = diagnosing(monkeypatch, killed)
    options = virtual(tmp_path, benches=("spring_weak", "finger"))
    with pytest.raises(KeyboardInterrupt):
        investigation.investigate(options, SilentOperator(), budget=8.0)
    page = investigation.investigate(options, SilentOperator(), budget=8.0)
    whole = ["diagnose 2", "carry on 3", "diagnose 3"]
    assert asked == [*whole[:killed], *whole[killed - 1 :]]
    dataset = load_dataset(options.out / "recordings")
    assert [r.name.removesuffix(".mcap") for r in dataset.train] == ["run_0", "run_1", "run_2"]
    log = read_log(options.out / "investigation.json", binding(options))
    assert log.ended == "the time at the bench is spent: 8 s were recorded"
    last, before = log.steps[-1], log.steps[-2]
    assert last.verdict == "explained"
    assert last.expected is not None
    assert last.brought(before) is not None
    assert "gravity misalignment" in page.read_text(encoding="utf-8")


def test_as_long_as_no_cause_is_known_the_library_goes_on() -> None:
    """No command can be designed for a cause that has no name: benches and motions in turn."""
    options = virtual(Path(), benches=("finger", "spring_weak"), run_length=12.0)
    log = InvestigationLog(options=OPTIONS, steps=investigation.first_steps(options))
    found: list[tuple[str, str]] = []
    for _ in range(3):
        unnamed = replace(log.steps[-1], verdict="unexplained", probabilities={})
        log = replace(log, steps=(*log.steps[:-1], unnamed))
        log = choose_next(log, None, options, SilentOperator(), 200.0)
        found.append((log.steps[-1].bench, log.steps[-1].excitation))
    assert found == [("spring_weak", "sine"), ("finger", "sine"), ("finger", "ramps")]
    assert log.steps[-1].name == "run_4"
    assert log.ended is None


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ("t,angle\n0,1\n4,1\n", "a task is a recording, or a CSV file with the columns t"),
        ("t,theta_d\n0,1\n1,1\n", "increase over 2 to 120 s; these last 1 s"),
        ("t,theta_d\n0,1\n4,7\n", "commands of a task are 0 to .*; these are 1.000 to 7.000"),
    ],
)
def test_a_task_that_cannot_be_predicted_is_refused(rows: str, words: str, tmp_path: Path) -> None:
    """Before anything is written; what `plan` writes is a task as it is."""
    path, setting = tmp_path / "task.csv", Setting(bench="finger")
    path.write_text(rows, encoding="utf-8")
    with pytest.raises(InvalidRecording, match=words):
        investigation.investigate(virtual(tmp_path, task=path), SilentOperator(), budget=60.0)
    assert not (tmp_path / "out").exists()
    plan = plan_run(setting, "ramps", 0, 4.0)
    write_command(path, plan)
    np.testing.assert_allclose(read_task(path, setting).command, plan.command, atol=1e-5)


def test_a_bench_that_stands_alone_is_seen_twice() -> None:
    """And each of several once: the held-out run is of the one that is mounted."""
    alone, several = (
        [(s.name, s.bench, s.excitation, s.split) for s in investigation.first_steps(options)]
        for options in (
            virtual(Path(), benches=("finger",)),
            virtual(Path(), benches=("finger", "spring_weak")),
        )
    )
    assert [step[1:] for step in alone] == [
        ("finger", "random_steps", "test"),
        ("finger", "random_steps", "train"),
        ("finger", "ramps", "train"),
    ]
    assert [step[:2] for step in several] == [
        ("test_0", "finger"),
        ("run_0", "finger"),
        ("run_1", "spring_weak"),
    ]


def virtual(folder: Path, **changes: Any) -> InvestigateOptions:
    """Return the options of a short investigation of a virtual unit."""
    options = InvestigateOptions(
        port="virtual::3",
        out=folder / "out",
        benches=("spring_weak",),
        run_length=2.0,
        faster_than_real_time=True,
    )
    return replace(options, **changes)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"benches": ()}, "--benches must name the bench that is mounted"),
        ({"benches": ("foo",)}, "No bench with a tendon for --benches named 'foo'; known: finger"),
        ({"benches": ("finger", "finger")}, "--benches names each bench once"),
        (
            {"port": "virtual:finger:3", "benches": ("finger", "spring_weak")},
            "names the bench 'finger'; 'spring_weak' is to be recorded.*virtual::3",
        ),
        ({"port": "virtual::three"}, "seed of a virtual bench is a whole number"),
        ({"port": "virtual::3:rust"}, "worn in one of the ways new"),
        ({"port": "/dev/ttyUSB0"}, "only a virtual bench can be faster than real time"),
        ({"servo": "xc9"}, "No servo named 'xc9'"),
        ({"virtual_load_cell_rate": 7}, "a virtual load cell gives 80, 20, 10"),
        ({"run_length": 1.9}, "--run-length must be 2 to 120 s; it is 1.9 s"),
        ({"run_length": float("nan")}, "--run-length must be 2 to 120 s; it is nan s"),
        ({"run_length": 20.5}, "which take 61.5 s with --run-length 20.5; it is 60 s"),
        ({"rate": 81.0}, "whole multiple of the command rate"),
        ({"force_limit": -1.0}, "the limit of force must be above 0"),
        ({"known": Path("none.toml")}, "none.toml: .*no such file"),
        ({"task": Path("none.csv")}, "none.csv"),
        ({"calibration": Path("cell.toml")}, "cell.toml: a calibration is a TOML file"),
    ],
)
def test_an_investigation_that_cannot_be_leaves_nothing_behind(changes, words, tmp_path) -> None:
    """Each option is refused in its own words before the folder is made."""
    with pytest.raises(TendonNewtonError, match=words):
        investigation.investigate(virtual(tmp_path, **changes), SilentOperator(), budget=60.0)
    assert not (tmp_path / "out").exists()


def test_a_bench_that_is_not_there_leaves_nothing_behind(tmp_path: Path) -> None:
    """The bench is examined before the folder is made: what was found, and what to do."""
    options = virtual(tmp_path, port=str(tmp_path / "ttyUSB9"), faster_than_real_time=False)
    with pytest.raises(BenchNotReady, match=r"must be mended.*servo port.*ttyUSB9"):
        investigation.investigate(options, SilentOperator(), budget=60.0)
    assert not (tmp_path / "out").exists()


def test_options_that_fit_are_taken() -> None:
    """First runs fill a budget, and a unit without a bench's name has every bench."""
    options = virtual(Path(), port="virtual::3:planted", benches=("finger", "spring_weak"))
    ready = check(replace(options, run_length=20.0), budget=60.0)
    assert {bench: a.bench for bench, a in ready.addresses.items()} == {
        "finger": "finger",
        "spring_weak": "spring_weak",
    }


def test_a_folder_without_a_recording_holds_nothing_to_go_on_with(tmp_path: Path) -> None:
    """A log that was left behind by other options blocks only what was recorded with them."""
    options = virtual(tmp_path)
    (tmp_path / "out").mkdir()
    write_log(tmp_path / "out" / "investigation.json", InvestigationLog(options=OPTIONS))
    assert investigation.begun(options).options == binding(options)
    list_run(tmp_path / "out" / "recordings")
    with pytest.raises(InvalidOutput, match="begun with --port not given, --benches finger"):
        investigation.begun(options)


@pytest.mark.parametrize(("reason", "goes_on"), [(SPENT, True), ("nothing is open", False)])
def test_a_larger_budget_takes_up_what_ended_for_want_of_time(reason, goes_on, tmp_path) -> None:
    """What ended for another reason stays ended."""
    options = virtual(tmp_path)
    list_run(tmp_path / "out" / "recordings")
    log = InvestigationLog(options=binding(options), ended=f"{reason}: 24 s were recorded")
    write_log(tmp_path / "out" / "investigation.json", log)
    assert (investigation.begun(options).ended is None) == goes_on


def list_run(folder: Path) -> None:
    """List a recording in a dataset, without its file."""
    folder.mkdir(parents=True)
    list_recording(folder, ListedRecording(file="run_0.mcap", bench="finger", split="train"))


Fault = Callable[[Bench, StopRequest], None]


def spoil_first_bench(monkeypatch: pytest.MonkeyPatch, fault: Fault) -> list[Bench]:
    """Let a fault strike the first run, and nothing be diagnosed; return benches as they open."""
    opened: list[Bench] = []

    @contextmanager
    def spoilt_bench(*words: Any) -> Generator[Bench]:
        with open_bench(*words) as bench:
            opened.append(bench)
            if len(opened) == 1:
                at_instant(bench, BEGIN, lambda: fault(bench, StopRequest()))
            yield bench

    def end(*_: Any, **__: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(collect_plan, "open_bench", spoilt_bench)
    monkeypatch.setattr(investigation, "diagnose_into", end)
    return opened


@pytest.mark.parametrize(
    ("fault", "length", "said"),
    [
        (let("unplug", duration=LONG), 16.0, "it has been silent for 10"),
        (let("cell_silence", duration=LONG), 8.0, "has been silent for 3"),
        (on.stuck(0), 8.0, "must be alive"),
    ],
)
def test_a_fault_ends_a_run_as_in_collect_and_the_same_call_goes_on(
    fault: Fault, length: float, said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An adapter out of its socket, a load cell that is dead: no run is listed, the motor is off.

    Once it is mended the run is recorded anew under another name, and what is recorded stays.
    """
    opened = spoil_first_bench(monkeypatch, fault)
    options, operator = virtual(tmp_path, run_length=length), SilentOperator()
    with pytest.raises(SafetyStop, match=said):
        investigation.investigate(options, operator, budget=60.0)
    recordings = tmp_path / "out" / "recordings"
    assert listed_files(recordings) == ()
    assert not on.plant(opened[0]).lines[0].motor.duty
    for _ in range(2):
        with pytest.raises(KeyboardInterrupt):
            investigation.investigate(options, operator, budget=60.0)
        assert listed_files(recordings) == ("test_0_again1.mcap", "run_0.mcap", "run_1.mcap")
    assert len(opened) == 4


def test_an_adapter_that_comes_back_soon_leaves_a_gap(tmp_path, monkeypatch) -> None:
    """Two seconds out of its socket: the run pauses, goes on, and is listed."""
    spoil_first_bench(monkeypatch, let("unplug", duration=2.0))
    with pytest.raises(KeyboardInterrupt):
        investigation.investigate(virtual(tmp_path, run_length=8.0), SilentOperator(), budget=60.0)
    test, *_ = listed_files(tmp_path / "out" / "recordings")
    dataset = load_dataset(tmp_path / "out" / "recordings")
    assert test == "test_0.mcap"
    assert np.diff(dataset.test[0].time).max() > 1.5
