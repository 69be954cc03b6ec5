"""One planted unit, looked at in one way: recorded, diagnosed, and written as one JSON file."""

from __future__ import annotations

import time
import tomllib
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from tendon_hardware.collection.excitation_plan import find_plan
from tendon_hardware.control.operator import SilentOperator
from tendon_hardware.virtual_bench.physics.planted import planted_causes
from tendon_newton.data.dataset import load_dataset
from tendon_newton.data.files.json_file import read_json, write_json
from tendon_newton.data.model_file import load_model
from tendon_newton.diagnosis.next_experiment.open_class_file import FILE
from tendon_newton.diagnosis.reporting.report import Origin
from tendon_newton.errors import InvalidOutput
from tendon_newton.workflows.collection import record
from tendon_newton.workflows.diagnosing import diagnose_into
from tendon_newton.workflows.investigation import LOG, investigate
from tendon_newton.workflows.investigation_check import first_runs
from tendon_newton.workflows.investigation_choice import RECORDINGS, SPENT
from tendon_newton.workflows.options import CollectOptions, InvestigateOptions

INVESTIGATE, QUICK, PAPER = "investigate", "quick", "paper"
WAYS = (INVESTIGATE, QUICK, PAPER)
"""How a unit is looked at: by designed runs, or by a plan of ``collect`` and one diagnosis."""
PROMISE = "a result of this study is a JSON file"


@dataclass(frozen=True, kw_only=True)
class Answer:
    """What a diagnosis says, and what was spent until then."""

    run: str
    """The last run that it has seen, with its bench."""
    bench_seconds: float
    """Time of all recordings so far [s]."""
    wall_seconds: float
    """Time of the diagnosis on this computer [s]."""
    verdict: str
    finished: bool
    """Whether the search came to its end."""
    named: tuple[str, ...]
    classes: tuple[tuple[str, ...], ...]
    """Causes that are not told apart, the named one first."""
    why: str = ""
    """What the run was chosen for."""
    settled: tuple[tuple[str, ...], ...] = ()
    """Classes of the diagnosis before that are gone."""
    expected: Mapping[str, float] = field(default_factory=dict)
    """Information expected about each number [bit]."""
    brought: Mapping[str, float] = field(default_factory=dict)
    """Information that came about each number of both diagnoses [bit]."""


@dataclass(frozen=True, kw_only=True)
class Result:
    """A unit looked at in one way."""

    unit: int
    way: str
    planted: Mapping[str, float]
    """Wrong thing -> its size."""
    true: tuple[str, ...]
    """Effects that the unit has, planted or of its own."""
    answers: tuple[Answer, ...]
    ended: str
    """Why nothing more was recorded; empty while something may be."""


@dataclass(frozen=True, kw_only=True)
class Effort:
    """What a unit may cost."""

    bench: float
    """Time of recordings of an investigation [s]."""
    run_length: float
    """Length of its runs [s]."""
    diagnosis: float | None
    """Time of a diagnosis on this computer [s]."""
    wall: float
    """Time after which no further run is begun [s]."""


def look(unit: int, way: str, out: Path, effort: Effort) -> Result:
    """Look at a unit and write ``DIR/result_WAY_UNIT.json``; what is on disk is not done again."""
    folder = out / f"{way}_{unit}"
    write = result_writer(unit, way, folder, out / f"result_{way}_{unit}.json")
    if way == INVESTIGATE:
        return look_step_by_step(unit, folder, effort, write)
    options = CollectOptions(port=port_of(unit), out=folder, plan=way, faster_than_real_time=True)
    record(options, SilentOperator())
    answer = folder / "diagnosis"
    if not (answer / FILE).exists():
        origin = Origin(dataset=folder, command="tendon-newton diagnose")
        diagnose_into(
            answer,
            load_dataset(folder),
            load_model(folder / "model.toml"),
            origin,
            progress=told,
            budget=effort.diagnosis,
        )
    seconds = sum(run.duration for run in find_plan(way))
    return write((answer_of(answer, way, seconds),), "the plan is recorded")


def look_step_by_step(unit: int, folder: Path, effort: Effort, write: Any) -> Result:
    """Investigate a unit, one run more at each call, and write the result after each."""
    options = InvestigateOptions(
        port=port_of(unit),
        out=folder,
        run_length=effort.run_length,
        faster_than_real_time=True,
    )
    first = 1 + len(first_runs(options.benches))
    start, budget = time.monotonic(), first * effort.run_length
    while True:
        investigate(options, Telling(), budget=budget, diagnosis_budget=effort.diagnosis)
        log = read_json(folder / LOG, InvalidOutput, "a log is a JSON file")
        goes_on = log["ended"].startswith(SPENT) and budget + effort.run_length <= effort.bench
        result = write(answers_of(folder, log), "" if goes_on else log["ended"])
        if not goes_on or time.monotonic() - start > effort.wall:
            return result
        budget += effort.run_length


def answers_of(folder: Path, log: Mapping[str, Any]) -> tuple[Answer, ...]:
    """Return the diagnoses of an investigation in order."""
    answers: list[Answer] = []
    seconds, runs = 0.0, 0
    for step in log["steps"]:
        seconds += step["seconds"]
        runs += step["split"] == "train"
        if step["verdict"] is None:
            continue
        answer = folder / f"diagnosis_{runs}"
        answers.append(
            answer_of(
                answer,
                f"{step['name']} on {step['bench']}",
                seconds,
                why=step["why"],
                settled=tuple(map(tuple, step["settled"])),
                expected=step["expected"] or {},
                brought=step["brought"] or {},
            )
        )
    return tuple(answers)


def answer_of(folder: Path, run: str, seconds: float, **path: Any) -> Answer:
    """Read a diagnosis.

    Args:
        folder: Has ``diagnosis.json``.
        run: The last run that it has seen.
        seconds: Time of all recordings [s].
        path: What an investigation knows besides.
    """
    table = read_json(folder / FILE, InvalidOutput, "a diagnosis is a JSON file")
    classes = [(row["name"], *row["indistinguishable_from"]) for row in table["effects"]]
    return Answer(
        run=run,
        bench_seconds=seconds,
        wall_seconds=table["wall_time_s"],
        verdict=table["verdict"],
        finished=table["finished"],
        named=tuple(row["name"] for row in table["effects"]),
        classes=tuple(names for names in classes if len(names) > 1),
        **path,
    )


def result_writer(unit: int, way: str, folder: Path, path: Path) -> Any:
    """Return what writes the result of a unit."""

    def write(answers: tuple[Answer, ...], ended: str) -> Result:
        recordings = folder / RECORDINGS if way == INVESTIGATE else folder
        planted = planted_causes(unit)
        result = Result(
            unit=unit,
            way=way,
            planted=planted,
            true=tuple(sorted({*planted, *true_causes(recordings)})),
            answers=answers,
            ended=ended,
        )
        write_json(path, asdict(result))
        return result

    return write


def true_causes(recordings: Path) -> set[str]:
    """Return the effects that a unit's constants amount to on the benches that were recorded."""
    plants = [tomllib.loads(p.read_text("utf-8")) for p in recordings.glob("plant_*.toml")]
    return {effect["name"] for plant in plants for effect in plant["effects"]}


def read_result(path: Path) -> Result:
    """Read what `look` wrote."""
    table = read_json(path, InvalidOutput, PROMISE)
    answers = tuple(
        Answer(
            **{
                **row,
                "named": tuple(row["named"]),
                "classes": tuple(map(tuple, row["classes"])),
                "settled": tuple(map(tuple, row["settled"])),
            }
        )
        for row in table["answers"]
    )
    return Result(**{**table, "true": tuple(table["true"]), "answers": answers})


def port_of(unit: int) -> str:
    """Return the port of a unit with three wrong things."""
    return f"virtual::{unit}:planted"


def told(text: str) -> None:
    """Print progress with the time of day: processes of a night are compared by it."""
    print(f"{time.strftime('%H:%M:%S')} {text}", flush=True)


class Telling(SilentOperator):
    """Says everything into the log of the process."""

    def announce(self, text: str) -> None:
        """Print it."""
        told(text)
