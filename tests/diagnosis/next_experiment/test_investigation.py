"""An investigation: what it writes, when it ends, and that it goes on where it stopped."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from hardware.control.operator import SilentOperator
from tendon_newton.data.dataset import load_dataset
from tendon_newton.diagnosis.next_experiment.investigation_log import (
    InvestigationLog,
    Step,
    read_log,
    with_answer,
    write_log,
)
from tendon_newton.errors import InvalidOutput
from tendon_newton.workflows import investigation
from tendon_newton.workflows.options import InvestigateOptions
from tests.diagnosis.next_experiment.test_experiment import write_open_class

STEP = Step(name="run_0", bench="finger", seconds=12.0, why="first")
TILT, OFFSET = ("gravity_misalignment", "angle"), ("position_offset", "angle")


def test_a_log_is_read_as_it_was_written(tmp_path: Path) -> None:
    """Steps with commands, causes and classes; of another seed or broken it is refused."""
    step = replace(
        STEP,
        command=(0.0, 1.5),
        expected={"a.x": 1.0},
        brought={"a.x": 0.5},
        verdict="explained",
        causes={"a": {"x": (1.0, 0.9, 1.1)}},
        open=(("a", "b"),),
        settled=(("c", "d"),),
    )
    log = InvestigationLog(seed=3, benches=("finger",), steps=(STEP, step), ended="done")
    path = tmp_path / "log.json"
    write_log(path, log)
    assert read_log(path, seed=3, benches=("finger",)) == log
    assert step.bits == (1.0, 0.5)
    with pytest.raises(InvalidOutput, match="seed = 3"):
        read_log(path, seed=4, benches=("finger",))
    path.write_text(path.read_text(encoding="utf-8").replace('"why"', '"what"'), encoding="utf-8")
    with pytest.raises(InvalidOutput, match="a step of the log is broken"):
        read_log(path, seed=3, benches=("finger",))


def test_half_an_interval_is_a_bit(tmp_path: Path) -> None:
    """What came is read from the two diagnoses, and a class that went is settled."""
    for name, others in (("before", (OFFSET,)), ("after", ())):
        (tmp_path / name).mkdir()
        write_open_class(tmp_path / name, TILT, *others)
    path = tmp_path / "after" / "diagnosis.json"
    table = json.loads(path.read_text(encoding="utf-8"))
    table["effects"][0]["parameters"]["angle"]["ci95"] = [0.295, 0.305]
    path.write_text(json.dumps(table), encoding="utf-8")
    step = with_answer(STEP, path, tmp_path / "before" / "diagnosis.json")
    assert step.brought == pytest.approx({"gravity_misalignment.angle": 1.0})
    assert step.settled == (("gravity_misalignment", "position_offset"),)
    assert step.open == ()


@pytest.mark.parametrize(
    ("steps", "words"),
    [
        ((replace(STEP, verdict="explained"),), "every cause stands alone"),
        ((replace(STEP, verdict="unexplained"),), None),
        ((replace(STEP, verdict="explained", open=(("a", "b"),)),), None),
        ((replace(STEP, seconds=50.0, verdict="unexplained"),), "the time at the bench is spent"),
        (
            (replace(STEP, verdict="unexplained", open=(("a", "b"),), brought={"a.x": 0.1}),) * 2,
            "the last 2 runs brought nothing new; left open: a or b",
        ),
    ],
)
def test_it_ends_for_a_reason(steps: tuple[Step, ...], words: str | None) -> None:
    """And goes on as long as there is none."""
    log = InvestigationLog(seed=0, benches=("finger",), steps=steps)
    reason = investigation.reason_to_end(log, 60.0, 12.0)
    assert reason is None if words is None else str(reason).startswith(words)


def test_it_goes_on_where_it_was_killed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Recordings on a virtual bench, and diagnoses that leave a class open once, then none.

    The first call is killed while it diagnoses for the second time: the next one repeats nothing
    that was recorded or diagnosed.
    """
    diagnosed: list[int] = []

    def answer(out: Path, dataset: Any, *_: Any, **__: Any) -> None:
        diagnosed.append(len(dataset.train))
        if len(diagnosed) == 2:
            raise KeyboardInterrupt
        out.mkdir(exist_ok=True)
        write_open_class(out, TILT, *((OFFSET,) if len(dataset.train) == 1 else ()))

    monkeypatch.setattr(investigation, "diagnose_into", answer)
    options = InvestigateOptions(
        port="virtual::3",
        out=tmp_path,
        benches=("spring_weak", "finger"),
        run_length=2.0,
        faster_than_real_time=True,
    )
    with pytest.raises(KeyboardInterrupt):
        investigation.investigate(options, SilentOperator(), budget=60.0)
    page = investigation.investigate(options, SilentOperator(), budget=60.0)
    assert diagnosed == [1, 2, 2]
    dataset = load_dataset(tmp_path / "recordings")
    assert [r.name.removesuffix(".mcap") for r in dataset.train] == ["run_0", "run_1"]
    log = read_log(tmp_path / "investigation.json", seed=0, benches=("spring_weak", "finger"))
    assert log.ended == "every cause stands alone"
    assert log.steps[-1].settled == (("gravity_misalignment", "position_offset"),)
    assert "gravity misalignment" in page.read_text(encoding="utf-8")
