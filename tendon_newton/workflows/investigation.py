"""Record, diagnose, choose the next run by what it is expected to tell, and begin again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from hardware.collection.collect_plan import SINGLE_RUNS, collect
from hardware.collection.collect_settings import CollectSettings
from hardware.collection.excitation_plan import DesignedRun, PlannedRun
from hardware.control.operator import Operator
from hardware.safety_rules.bench_limits import SafetyLimits
from hardware.servos import find_servo
from hardware.servos.host_position_loop import HostPositionLoop, no_stronger
from hardware.stop_request import StopRequest
from tendon_newton.data.dataset import listed_files, load_dataset
from tendon_newton.data.excitations import DESIGNED
from tendon_newton.data.files.result_folder import make_folder
from tendon_newton.data.model_file import load_model
from tendon_newton.diagnosis.explanation import OpenClass, Setting
from tendon_newton.diagnosis.next_experiment.investigation_log import (
    InvestigationLog,
    Step,
    read_log,
    with_answer,
    write_log,
)
from tendon_newton.diagnosis.next_experiment.run_design import Expected, design, plan_of
from tendon_newton.diagnosis.reporting.path_report import write_path_report
from tendon_newton.diagnosis.reporting.report import Origin
from tendon_newton.exam.open_class_file import FILE, read_answer, read_open_class
from tendon_newton.workflows.collection import address_of
from tendon_newton.workflows.diagnosing import diagnose_into
from tendon_newton.workflows.options import InvestigateOptions

RECORDINGS, LOG, REPORT = "recordings", "investigation.json", "investigation.html"
"""What stands in the folder of an investigation, beside a folder for each diagnosis."""
CHANGE_OF_BENCH = 60.0
"""Time that it takes a person to mount another bench [s]; a virtual one is there at once."""
FORCE_SHARE = 0.8
"""Share of the tension limit that no designed run may reach in simulation [1]."""
LITTLE = 0.5
"""A run that is expected to bring less is not worth its time [bit]."""
IDLE = 2
"""Runs in a row after which an investigation that learns nothing ends."""


@dataclass(frozen=True, kw_only=True)
class NextRun:
    """What to record, and why."""

    expected: Expected
    why: str


def investigate(options: InvestigateOptions, operator: Operator, *, budget: float) -> Path:
    """Go on with an investigation, or begin one, until nothing is left to learn.

    Every step is on disk before the next begins: the same call takes an investigation up again.

    Args:
        options: The bench, the folder, the length of a run.
        operator: Who stands at the bench.
        budget: Time that recordings may take [s].

    Returns:
        The page that shows the path.
    """
    out = make_folder(options.out)
    log = read_log(out / LOG, seed=options.seed, benches=options.benches)
    with StopRequest() as stop:
        while log.ended is None:
            log = record_open_runs(log, options, operator, stop)
            log = diagnose_last(log, options, operator)
            log = choose_next(log, options, operator, budget)
            write_log(out / LOG, log)
            write_path_report(out / REPORT, log, out)
    operator.announce(f"the end: {log.ended}")
    return out / REPORT


def record_open_runs(
    log: InvestigationLog, options: InvestigateOptions, operator: Operator, stop: StopRequest
) -> InvestigationLog:
    """Record the runs that are planned and not listed yet."""
    folder = options.out / RECORDINGS
    log = log if log.steps else replace(log, steps=first_steps(options))
    write_log(options.out / LOG, log)
    done = {Path(file).stem for file in listed_files(folder)}
    for step in log.steps:
        if step.name in done:
            continue
        settings = settings_of_runs(options)
        address = address_of(
            options,
            step.bench,
            port=options.port,
            load_cell_rate=options.virtual_load_cell_rate,
        )
        operator.announce(f"{step.name} on {step.bench}: {step.why}")
        made = collect(
            address,
            [planned(step, options)],
            settings,
            folder,
            operator,
            stop,
            title=SINGLE_RUNS,
        )
        last = made.outcomes[-1]
        if last.fault is not None:
            raise last.fault
        if last.interrupted is not None:
            raise KeyboardInterrupt
    return log


def settings_of_runs(options: InvestigateOptions) -> CollectSettings:
    """Return rates, loop and limits of all runs."""
    return CollectSettings(
        rate=options.rate,
        loop=no_stronger(HostPositionLoop(), find_servo(options.servo)),
        limits=SafetyLimits(force=options.force_limit, temperature=options.temperature_limit),
        seed=options.seed,
        spool_radius=options.spool_radius,
        notes=options.notes,
    )


def first_steps(options: InvestigateOptions) -> tuple[Step, ...]:
    """Return what is recorded before anything is known: steps to learn from and steps to test."""
    bench = options.benches[0]
    return (
        Step(
            name="test_0",
            bench=bench,
            split="test",
            seconds=options.run_length,
            why="held out: it only says how large the error is",
        ),
        Step(
            name="run_0",
            bench=bench,
            seconds=options.run_length,
            why="steps to random angles, which excite most causes",
        ),
    )


def planned(step: Step, options: InvestigateOptions) -> PlannedRun:
    """Return the run of a step: its own command, or steps to random angles without one."""
    common: dict[str, Any] = {
        "name": step.name,
        "bench": step.bench,
        "duration": step.seconds,
        "split": step.split,
    }
    if step.command is None:
        return PlannedRun(**common, excitation="random_steps")
    return DesignedRun(**common, excitation=DESIGNED, angles=step.command)


def diagnose_last(
    log: InvestigationLog, options: InvestigateOptions, operator: Operator
) -> InvestigationLog:
    """Diagnose all recordings unless it was done, and say what the last one brought."""
    number, out = log.runs, options.out
    folder = out / f"diagnosis_{number}"
    if not (folder / FILE).exists():
        dataset = load_dataset(out / RECORDINGS)
        model = load_model(options.known or out / RECORDINGS / "model.toml")
        diagnose_into(
            folder,
            dataset,
            model,
            Origin(dataset=out / RECORDINGS, command=f"tendon-newton investigate --out {out}"),
            progress=lambda text: operator.announce(f"  diagnosis {number}: {text}"),
        )
    earlier = out / f"diagnosis_{number - 1}" / FILE
    last = with_answer(log.steps[-1], folder / FILE, earlier if earlier.exists() else None)
    operator.announce(f"  {last.text()}")
    return replace(log, steps=(*log.steps[:-1], last))


def choose_next(
    log: InvestigationLog, options: InvestigateOptions, operator: Operator, budget: float
) -> InvestigationLog:
    """Add the run that is expected to bring the most, or say why there is none."""
    reason = reason_to_end(log, budget, options.run_length)
    if reason is not None:
        return replace(log, ended=reason)
    chosen = next_run(log, options, operator)
    if chosen is None:
        return replace(log, ended=no_run_text(log))
    plan = chosen.expected.prediction.plan
    return replace(
        log,
        steps=(
            *log.steps,
            Step(
                name=f"run_{log.runs}",
                bench=plan.setting.bench,
                seconds=options.run_length,
                why=chosen.why,
                command=tuple(np.round(plan.command, 4).tolist()),
                expected={k: round(v, 3) for k, v in chosen.expected.numbers.items()},
            ),
        ),
    )


def reason_to_end(log: InvestigationLog, budget: float, length: float) -> str | None:
    """Return why nothing more is to be recorded; None where something is."""
    last = log.steps[-1]
    if last.verdict in ("no_gap", "explained") and not last.open:
        return "every cause stands alone"
    if log.seconds + length > budget:
        return f"the time at the bench is spent: {log.seconds:.0f} s were recorded"
    idle = [step for step in log.steps[-IDLE:] if step.brought is not None]
    if len(idle) == IDLE and all(step.taught_nothing(LITTLE) for step in idle):
        return f"the last {IDLE} runs brought nothing new" + still_open(last)
    return None


def no_run_text(log: InvestigationLog) -> str:
    """Say what no run on these benches can tell."""
    return "no run on these benches is expected to tell more" + still_open(log.steps[-1])


def still_open(step: Step) -> str:
    """Return what a step leaves open, in words."""
    if not step.open:
        return ""
    pairs = "; ".join(" or ".join(names) for names in step.open)
    return f"; left open: {pairs}. Another load, spring or posture may tell them apart"


def next_run(
    log: InvestigationLog, options: InvestigateOptions, operator: Operator
) -> NextRun | None:
    """Return the run that tells a class apart, or else the one that narrows intervals most."""
    folder = options.out / f"diagnosis_{log.runs}"
    known = [plan_of(r) for r in load_dataset(options.out / RECORDINGS).train]
    settings = [Setting(bench=bench) for bench in options.benches]
    rng = np.random.default_rng([options.seed, log.runs])

    def best(question: OpenClass) -> Expected | None:
        found = design(
            question,
            known,
            settings,
            rng,
            duration=options.run_length,
            force_limit=FORCE_SHARE * options.force_limit,
            progress=lambda text: operator.announce(f"  next run: {text}"),
        )
        return nearest(found, log.steps[-1].bench, options)

    for names in log.steps[-1].open:
        expected = best(read_open_class(folder, names[0]))
        if expected is not None and expected.settles > 0.0:
            return NextRun(expected=expected, why=f"to tell {' from '.join(names)}")
    expected = best(read_answer(folder))
    if expected is None or expected.bits < LITTLE:
        return None
    most = max(expected.numbers, key=lambda name: expected.numbers[name])
    return NextRun(
        expected=expected, why=f"{expected.bits:.1f} bits are expected, most of them on {most}"
    )


def nearest(
    found: Sequence[Expected], mounted: str, options: InvestigateOptions
) -> Expected | None:
    """Return the run that is worth most for its time; another bench takes a person's time."""
    change = 0.0 if options.port.startswith("virtual") else CHANGE_OF_BENCH

    def rate(expected: Expected) -> float:
        away = expected.prediction.plan.setting.bench != mounted
        return expected.worth / (options.run_length + change * away)

    return max(found, key=rate, default=None)
