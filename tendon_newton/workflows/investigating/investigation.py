"""Record, diagnose, choose the next run by what it is expected to tell, and begin again."""

import shlex
from dataclasses import replace
from pathlib import Path

from tendon_hardware.collection.collect_plan import SINGLE_RUNS, collect, recorded_runs
from tendon_hardware.collection.excitation_plan import DesignedRun, PlannedRun
from tendon_hardware.control.operator import Operator
from tendon_hardware.stop_request import StopRequest
from tendon_newton.data.dataset import load_dataset
from tendon_newton.data.excitations import DESIGNED
from tendon_newton.data.files.output_folder import make_folder
from tendon_newton.data.model_file import Model, load_model
from tendon_newton.diagnosis.diagnosis_file import diagnosis_table, read_diagnosis
from tendon_newton.diagnosis.next_experiment.investigation_log import (
    InvestigationLog,
    Step,
    read_log,
    with_answer,
    write_log,
)
from tendon_newton.diagnosis.next_experiment.open_sets import OpenSets, likeliest
from tendon_newton.diagnosis.next_experiment.open_sets_file import FILE, read_scale
from tendon_newton.diagnosis.posterior import ENDING, Posterior, read_posterior, write_posterior
from tendon_newton.diagnosis.reporting.path_report import write_path_report
from tendon_newton.diagnosis.reporting.report import Origin
from tendon_newton.diagnosis.search.decide.go_on import go_on
from tendon_newton.identification.noise_floor import NoiseFloor
from tendon_newton.workflows.diagnosing import diagnose_into
from tendon_newton.workflows.investigating.investigation_check import (
    Ready,
    binding,
    check,
    examine_bench,
    first_runs,
)
from tendon_newton.workflows.investigating.investigation_choice import (
    RECORDINGS,
    SPENT,
    choose_next,
)
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
            log = answer_last(log, options, operator, diagnosis_budget)
            log = choose_next(log, open_sets(log, options), options, operator, budget)
            if log.ended is not None:
                log = diagnosed(log, options, operator, diagnosis_budget)
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
    run = PlannedRun(
        name=step.name,
        bench=step.bench,
        excitation=step.excitation if step.command is None else DESIGNED,
        duration=step.seconds,
        split="test" if step.split == "test" else "train",
    )
    return run if step.command is None else DesignedRun(**vars(run), angles=step.command)


def answer_last(
    log: InvestigationLog, options: InvestigateOptions, operator: Operator, budget: float | None
) -> InvestigationLog:
    """Say what is known with the last run: sets of causes are carried on, or looked for anew."""
    known = read_sets(log.runs - 1, options.out)
    if diagnosis_folder(log.runs, options.out) or not (known and known.sets):
        return diagnosed(log, options, operator, budget)
    path = sets_file(log.runs, options.out)
    if not path.with_suffix(ENDING).exists():
        make_folder(path.parent)
        dataset = load_dataset(options.out / RECORDINGS)
        left = go_on(dataset.train, starting_model(options), known, progress=operator.announce)
        write_posterior(path, left)
    return answered(log, read_posterior(path), None, operator)


def diagnosed(
    log: InvestigationLog, options: InvestigateOptions, operator: Operator, budget: float | None
) -> InvestigationLog:
    """Diagnose all recordings unless it was done, and say what is known then.

    No sets are carried over: the answer is that of all recordings by the verb ``diagnose``.
    """
    number, out = log.runs, options.out
    folder = out / f"diagnosis_{number}"
    if diagnosis_folder(number, out) is None:
        diagnose_into(
            folder,
            load_dataset(out / RECORDINGS),
            starting_model(options),
            Origin(
                dataset=out / RECORDINGS,
                command=shlex.join(["tendon-newton", "investigate", "--out", str(out)]),
            ),
            progress=lambda text: operator.announce(f"  diagnosis {number}: {text}"),
            budget=budget,
        )
    path = folder / FILE
    return answered(log, read_posterior(path), read_diagnosis(path).verdict, operator)


def answered(
    log: InvestigationLog, posterior: Posterior, verdict: str | None, operator: Operator
) -> InvestigationLog:
    """Note what is known with the last run."""
    last = with_answer(log.steps[-1], posterior, verdict)
    operator.announce(f"  {last.text()}")
    return replace(log, steps=(*log.steps[:-1], last))


def open_sets(log: InvestigationLog, options: InvestigateOptions) -> OpenSets | None:
    """Return what all runs leave open; None where no cause is known."""
    posterior = read_sets(log.runs, options.out)
    folders = [diagnosis_folder(k, options.out) for k in range(log.runs, 0, -1)]
    last = next((folder for folder in folders if folder is not None), None)
    if posterior is None or not posterior.sets or last is None:
        return None
    table = diagnosis_table(last / FILE)
    return OpenSets(
        posterior=likeliest(posterior),
        model=starting_model(options),
        noise=table.value("noise_floor", NoiseFloor),
        scale=read_scale(table),
        looks_further=True,
    )


def read_sets(number: int, out: Path) -> Posterior | None:
    """Read what is left open with so many runs, by a diagnosis if there is one."""
    folder = diagnosis_folder(number, out)
    path = sets_file(number, out) if folder is None else folder / FILE
    return read_posterior(path) if path.with_suffix(ENDING).is_file() else None


def diagnosis_folder(number: int, out: Path) -> Path | None:
    """Return the folder of the diagnosis of so many runs, once it is whole."""
    folder = out / f"diagnosis_{number}"
    return folder if (folder / FILE).exists() else None


def sets_file(number: int, out: Path) -> Path:
    """Return the file, less its ending, of the sets that are carried on to so many runs."""
    return out / "sets" / f"run_{number}.json"


def starting_model(options: InvestigateOptions) -> Model:
    """Return the model that every diagnosis starts from."""
    return load_model(options.known or options.out / RECORDINGS / "model.toml")
