"""Record, diagnose, choose the next run by what it is expected to tell, and begin again."""

from dataclasses import replace
from pathlib import Path
from typing import Any

from tendon_hardware.collection.collect_plan import SINGLE_RUNS, collect, recorded_runs
from tendon_hardware.collection.excitation_plan import DesignedRun, PlannedRun
from tendon_hardware.control.operator import Operator
from tendon_hardware.stop_request import StopRequest
from tendon_newton.data.dataset import load_dataset
from tendon_newton.data.excitations import DESIGNED
from tendon_newton.data.files.text_file import make_folder
from tendon_newton.data.model_file import load_model
from tendon_newton.diagnosis.next_experiment.investigation_log import (
    InvestigationLog,
    Step,
    read_log,
    with_answer,
    write_log,
)
from tendon_newton.diagnosis.next_experiment.open_class_file import FILE
from tendon_newton.diagnosis.reporting.path_report import write_path_report
from tendon_newton.diagnosis.reporting.report import Origin
from tendon_newton.workflows.diagnosing import diagnose_into
from tendon_newton.workflows.investigation_check import (
    Ready,
    binding,
    check,
    examine_bench,
    first_runs,
)
from tendon_newton.workflows.investigation_choice import RECORDINGS, SPENT, choose_next
from tendon_newton.workflows.options import InvestigateOptions

LOG, REPORT = "investigation.json", "investigation.html"
"""What stands in the folder of an investigation, beside recordings and diagnoses."""


def investigate(
    options: InvestigateOptions,
    operator: Operator,
    *,
    budget: float,
    diagnosis_budget: float | None = None,
) -> Path:
    """Go on with an investigation, or begin one, until nothing is left to learn.

    Every step is on disk before the next begins: the same call takes an investigation up again.

    Args:
        options: The bench, the folder, the length of a run.
        operator: Who stands at the bench.
        budget: Time that recordings may take [s].
        diagnosis_budget: Time that each diagnosis may take, about [s].

    Returns:
        The page that shows the path.

    Raises:
        TendonNewtonError: An option cannot be, and nothing was written; or a fault ended a run.
    """
    ready = check(options, budget=budget)
    log = begun(options)
    if not log.steps:
        operator.announce("looking at the bench")
        examine_bench(options, operator)
    out = make_folder(options.out)
    with StopRequest() as stop:
        while log.ended is None:
            log = record_open_runs(log, options, ready, operator, stop)
            log = diagnose_last(log, options, operator, diagnosis_budget)
            log = choose_next(log, options, operator, budget)
            write_log(out / LOG, log)
            write_path_report(out / REPORT, log, out)
    operator.announce(f"the end: {log.ended}")
    return out / REPORT


def begun(options: InvestigateOptions) -> InvestigationLog:
    """Return the log of a folder's investigation, or an empty one.

    A folder without a recording holds nothing to go on with. A budget that was spent may have
    grown since.
    """
    if not recorded_runs(options.out / RECORDINGS):
        return InvestigationLog(options=binding(options))
    log = read_log(options.out / LOG, binding(options))
    spent = log.ended is not None and log.ended.startswith(SPENT)
    return replace(log, ended=None) if spent else log


def record_open_runs(
    log: InvestigationLog,
    options: InvestigateOptions,
    ready: Ready,
    operator: Operator,
    stop: StopRequest,
) -> InvestigationLog:
    """Record the runs that are planned and not listed yet."""
    folder = options.out / RECORDINGS
    log = log if log.steps else replace(log, steps=first_steps(options))
    write_log(options.out / LOG, log)
    done = recorded_runs(folder)
    for step in log.steps:
        if step.name in done:
            continue
        operator.announce(f"{step.name} on {step.bench}: {step.why}")
        made = collect(
            ready.addresses[step.bench],
            [planned(step, options)],
            ready.settings,
            folder,
            operator,
            stop,
            title=SINGLE_RUNS,
        )
        last = made.outcomes[-1]
        if not last.finished:
            operator.announce(f"{step.name} is not finished; the same command goes on with it")
        if last.fault is not None:
            raise last.fault
        if last.interrupted is not None:
            raise KeyboardInterrupt
    return log


def first_steps(options: InvestigateOptions) -> tuple[Step, ...]:
    """Return what is recorded before anything is known: a run to test, and runs to learn from."""
    test = Step(
        name="test_0",
        bench=options.benches[0],
        split="test",
        seconds=options.run_length,
        why="held out: it only says how large the error is",
    )
    return (
        test,
        *(
            Step(
                name=f"run_{number}",
                bench=bench,
                seconds=options.run_length,
                why="what every bench shows, before anything is known",
                excitation=excitation,
            )
            for number, (bench, excitation) in enumerate(first_runs(options.benches))
        ),
    )


def planned(step: Step, options: InvestigateOptions) -> PlannedRun:
    """Return the run of a step: its own command, or one of the library without one."""
    common: dict[str, Any] = {
        "name": step.name,
        "bench": step.bench,
        "duration": step.seconds,
        "split": step.split,
    }
    if step.command is None:
        return PlannedRun(**common, excitation=step.excitation)
    return DesignedRun(**common, excitation=DESIGNED, angles=step.command)


def diagnose_last(
    log: InvestigationLog, options: InvestigateOptions, operator: Operator, budget: float | None
) -> InvestigationLog:
    """Diagnose all recordings unless it was done, and say what the last one brought."""
    number, out = log.runs, options.out
    folder = out / f"diagnosis_{number}"
    model = load_model(options.known or out / RECORDINGS / "model.toml")
    if not (folder / FILE).exists():
        dataset = load_dataset(out / RECORDINGS)
        diagnose_into(
            folder,
            dataset,
            model,
            Origin(dataset=out / RECORDINGS, command=f"tendon-newton investigate --out {out}"),
            progress=lambda text: operator.announce(f"  diagnosis {number}: {text}"),
            budget=budget,
        )
    earlier = out / f"diagnosis_{number - 1}" / FILE
    last = with_answer(
        log.steps[-1],
        folder / FILE,
        earlier if earlier.exists() else None,
        actuator=model.actuator.name,
    )
    operator.announce(f"  {last.text()}")
    return replace(log, steps=(*log.steps[:-1], last))
