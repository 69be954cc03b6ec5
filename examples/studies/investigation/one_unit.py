"""One planted unit, looked at in one way: recorded, diagnosed, scored, and written as JSON."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

from examples.studies.unit_score import CLASS, heard_as, judged
from examples.studies.units import truth_of
from tendon_hardware.collection.excitation_plan import find_plan
from tendon_hardware.virtual_bench.physics.wear import planted_causes
from tendon_newton.data.dataset import load_dataset
from tendon_newton.data.files.json_file import read_json, write_json
from tendon_newton.data.model_file import load_model
from tendon_newton.diagnosis.evaluation import evaluate_models
from tendon_newton.diagnosis.next_experiment.investigation_log import InvestigationLog, read_log
from tendon_newton.diagnosis.next_experiment.open_sets_file import FILE
from tendon_newton.diagnosis.reporting.report import Origin
from tendon_newton.diagnosis.search.search_worlds import SEARCH_STEP
from tendon_newton.effects import EFFECTS
from tendon_newton.errors import InvalidOutput
from tendon_newton.identification.study import Study
from tendon_newton.workflows.collection import record
from tendon_newton.workflows.diagnosing import diagnose_into
from tendon_newton.workflows.investigating.investigation import LOG, investigate
from tendon_newton.workflows.investigating.investigation_check import binding
from tendon_newton.workflows.investigating.investigation_choice import RECORDINGS
from tendon_newton.workflows.options import CollectOptions, InvestigateOptions
from tests.hardware.silent_operator import SilentOperator

INVESTIGATE, HALF, QUICK = "investigate", "half", "quick"
BENCH_SECONDS = sum(run.duration for run in find_plan(QUICK))  # Time at the bench of the plan [s]
BUDGETS = {HALF: BENCH_SECONDS / 2.0, INVESTIGATE: BENCH_SECONDS}
"""Investigation -> time at the bench [s]: half of one is its beginning, and is made before it."""
WAYS = (*BUDGETS, QUICK)
"""How a unit is looked at: by designed runs, or by a plan of ``collect`` and one diagnosis."""
JUDGE_SEED = 1  # Seed of the recordings by which both ways are judged: neither has seen them
PROMISE = "a result of this study is a JSON file"


@dataclass(frozen=True, kw_only=True)
class Result:
    """A unit looked at in one way."""

    unit: int
    way: str
    planted: Mapping[str, float]  # Wrong thing -> its size
    found: tuple[str, ...]
    """Planted causes that are named as they deserve, by the strict score of `unit_score`."""
    named: int  # Names of the answer
    deserved: int  # Names that are deserved
    theta: float  # RMS error of the motor angle on recordings that neither way has seen [rad]
    force: float  # That of the tension [N]
    runs: tuple[Mapping[str, float], ...]
    """Information expected and brought by each designed run [bit]: ``names``, ``task``,
    ``names_came``, ``task_came``; and ``seconds`` of computing, where this process did it [s]."""
    ended: str  # Why nothing more was recorded

    @property
    def error(self) -> float:
        """Both errors together: their geometric mean [(rad N)^(1/2)]."""
        return math.sqrt(self.theta * self.force)


def look(unit: int, way: str, out: Path, run_length: float) -> Result:
    """Look at a unit and write ``DIR/result_WAY_UNIT.json``; what is on disk is not done again."""
    path, operator = out / f"result_{way}_{unit}.json", Telling()
    if path.exists():
        return read_result(path)
    folder, runs, ended = out / f"{way}_{unit}", (), "the plan is recorded"
    if way in BUDGETS:
        folder = out / f"{INVESTIGATE}_{unit}"
        options = InvestigateOptions(
            port=port_of(unit), out=folder, run_length=run_length, faster_than_real_time=True
        )
        investigate(options, operator, budget=BUDGETS[way])
        log = read_log(folder / LOG, binding(options))
        runs, ended = runs_of(log, operator), log.ended or ""
        answer, recordings = folder / f"diagnosis_{log.runs}", folder / RECORDINGS
    else:
        record_plan(unit, folder, seed=0)
        answer, recordings = folder / "diagnosis", folder
        if not (answer / FILE).exists():
            diagnose_into(
                answer,
                load_dataset(folder),
                load_model(folder / "model.toml"),
                Origin(dataset=folder, command="tendon-newton diagnose"),
                progress=operator.announce,
            )
    judge = out / f"judge_{unit}"
    record_plan(unit, judge, seed=JUDGE_SEED)
    planted, errors = planted_causes(unit), errors_of(answer / "model.toml", judge)
    table = read_json(answer / FILE, InvalidOutput, "a diagnosis is a JSON file")
    truth = truth_of(recordings)
    names = [(row, judged(row, truth)) for row in table["effects"]]
    heard = frozenset[str]().union(
        *(heard_as(row["name"], *row["indistinguishable_from"][: CLASS - 1])
          for row, name in names if name.deserved)
    )  # fmt: skip
    result = Result(
        unit=unit,
        way=way,
        planted=planted,
        found=tuple(cause for cause in planted if cause in heard),
        named=len(names),
        deserved=sum(name.deserved for _, name in names),
        theta=errors[0],
        force=errors[1],
        runs=runs,
        ended=ended,
    )
    write_json(path, asdict(result))
    return result


def record_plan(unit: int, folder: Path, *, seed: int) -> None:
    """Record the plan ``quick``; a plan that is recorded is not recorded again."""
    options = CollectOptions(
        port=port_of(unit), out=folder, plan=QUICK, seed=seed, faster_than_real_time=True
    )
    record(options, SilentOperator())


def errors_of(model: Path, judge: Path) -> tuple[float, float]:
    """Return the RMS errors of a model on all recordings of a folder [rad, N]."""
    dataset = load_dataset(judge)
    study = Study(
        (*dataset.train, *dataset.test), load_model(model), tuple(EFFECTS), time_step=SEARCH_STEP
    )
    errors = evaluate_models(study, [{}])[0].pooled()
    return errors.theta_rmse, errors.force_rmse or 0.0


def runs_of(log: InvestigationLog, operator: Telling) -> tuple[dict[str, float], ...]:
    """Return what each designed run was expected to bring, and what it brought."""
    out: list[dict[str, float]] = []
    for before, step in zip(log.steps, log.steps[1:], strict=False):
        came = step.brought(before)
        if step.expected is None or came is None:
            continue
        row = {**step.expected, **{f"{key}_came": bits for key, bits in came.items()}}
        if (seconds := operator.seconds.get(step.name)) is not None:
            row["seconds"] = seconds
        out.append(row)
    return tuple(out)


def read_result(path: Path) -> Result:
    """Read what `look` wrote."""
    table = read_json(path, InvalidOutput, PROMISE)
    return Result(**{**table, "found": tuple(table["found"]), "runs": tuple(table["runs"])})


def port_of(unit: int) -> str:
    """Return the port of a unit with three wrong things."""
    return f"virtual::{unit}:planted"


class Telling(SilentOperator):
    """Says everything into the log of the process, and notes what each designed run costs."""

    def __init__(self) -> None:
        super().__init__()
        self.seconds: dict[str, float] = {}
        """Time of this process's cores from the run before to a designed run, by its name [s].
        What a whole diagnosis takes between them is not counted."""
        self._last: float | None = None

    def announce(self, text: str) -> None:
        """Print it with the time of day."""
        now, name = time.process_time(), text.partition(" on ")[0]
        if name.startswith("  diagnosis"):
            self._last = None
        elif name.startswith("run_"):
            if self._last is not None:
                self.seconds[name] = now - self._last
            self._last = now
        print(f"{time.strftime('%H:%M:%S')} {now:7.1f} s  {text}", flush=True)
