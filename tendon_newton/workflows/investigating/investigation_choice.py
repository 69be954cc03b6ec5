"""Choose the next run of an investigation, or say why there is none."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tendon_hardware.control.operator import Operator
from tendon_newton.data.dataset import load_dataset
from tendon_newton.data.excitations import DESIGNED, EXCITATIONS
from tendon_newton.diagnosis.explanation import Setting
from tendon_newton.diagnosis.next_experiment.by_hand import Worth, best_by_hand
from tendon_newton.diagnosis.next_experiment.expected_run import Expected, Forecast, plan_of
from tendon_newton.diagnosis.next_experiment.investigation_log import InvestigationLog, Step
from tendon_newton.diagnosis.next_experiment.open_sets import OpenSets
from tendon_newton.diagnosis.next_experiment.planned_runs import Plan
from tendon_newton.diagnosis.next_experiment.run_design import design, usual_task
from tendon_newton.diagnosis.next_experiment.task_file import read_task
from tendon_newton.diagnosis.next_experiment.worst_case import Designs
from tendon_newton.workflows.options import InvestigateOptions

RECORDINGS = "recordings"  # Folder of the dataset in that of an investigation
CHANGE_OF_BENCH = 60.0
"""Time that it takes a person to mount another bench [s]; a virtual one is there at once."""
FORCE_SHARE = 0.8  # Share of the tension limit that no designed run may reach in simulation [1]
LITTLE = 0.1  # A run that is expected to bring less is not worth its time [bit]
SPENT = "the time at the bench is spent"  # Beginning of the reason that a larger budget removes


def choose_next(
    log: InvestigationLog,
    question: OpenSets | None,
    options: InvestigateOptions,
    operator: Operator,
    budget: float,
) -> InvestigationLog:
    """Add the run that is expected to bring the most, or say why there is none.

    Args:
        question: What they leave open; None where no cause is known.
        budget: Time that recordings may take [s].
    """
    forecast: Forecast | None = None
    if question is not None:
        known = [plan_of(r) for r in load_dataset(options.out / RECORDINGS).train]
        forecast = Forecast(question, known, task_of(options))
        left = {"names": round(forecast.entropy, 3), "task": round(forecast.spread, 4)}
        log = replace(log, steps=(*log.steps[:-1], replace(log.steps[-1], left=left)))
    reason = reason_to_end(log, budget, options.run_length)
    if reason is not None:
        return replace(log, ended=reason)
    if forecast is None:
        step = library_run(log, options)
        if step is None:
            return replace(
                log, ended="every run of the library is recorded, and none shows a cause"
            )
        return replace(log, steps=(*log.steps, step))
    found = designed_runs(log, forecast, options, operator)
    expected = nearest(found.runs, log.steps[-1].bench, options)
    if expected is None:
        return replace(
            log,
            ended=f"every run that was tried may pull harder than {FORCE_SHARE:.0%} of "
            f"--force-limit {options.force_limit:g} N under some model that the data allow, the "
            f"calmest with {min(found.refused):.3g} N",
        )
    if expected.told.worth < LITTLE:
        return replace(log, ended="no run on these benches is expected to tell more")
    return with_designed(log, expected, best_by_hand(forecast), options)


def task_of(options: InvestigateOptions) -> Plan:
    """Return the run that a model shall predict, on the bench that is mounted first."""
    setting = Setting(bench=options.benches[0])
    if options.task is not None:
        return read_task(options.task, setting)
    return usual_task(setting, options.run_length)


def designed_runs(
    log: InvestigationLog, forecast: Forecast, options: InvestigateOptions, operator: Operator
) -> Designs:
    """Return runs on all benches that stay within the limit, best first."""
    return design(
        forecast,
        [Setting(bench=bench) for bench in options.benches],
        np.random.default_rng([options.seed, log.runs]),
        duration=options.run_length,
        force_limit=FORCE_SHARE * options.force_limit,
        progress=lambda text: operator.announce(f"  next run: {text}"),
    )


def with_designed(
    log: InvestigationLog, expected: Expected, by_hand: Worth | None, options: InvestigateOptions
) -> InvestigationLog:
    """Add a designed run, and a measurement by hand that tells more for its time."""
    told, last = expected.told, log.steps[-1]
    step = Step(
        name=f"run_{log.runs}",
        bench=expected.plan.setting.bench,
        seconds=options.run_length,
        why="what is expected to tell the most about what is open",
        excitation=DESIGNED,
        command=tuple(np.round(expected.plan.command, 4).tolist()),
        expected={"names": round(told.names, 3), "task": round(told.task, 3)},
    )
    if by_hand and by_hand.rate > 60.0 * (told.names + told.task) / options.run_length:
        last = replace(last, by_hand=by_hand.text())
    return replace(log, steps=(*log.steps[:-1], last, step))


def library_run(log: InvestigationLog, options: InvestigateOptions) -> Step | None:
    """Return a run of the library that was not recorded yet; None where there is none left.

    As long as no cause is named no command can be designed for one. The bench that is mounted comes
    first.
    """
    mounted = log.steps[-1].bench
    benches = (mounted, *(bench for bench in options.benches if bench != mounted))
    done = {(step.bench, step.excitation) for step in log.steps if step.split == "train"}
    for excitation in EXCITATIONS:
        for bench in benches:
            if (bench, excitation) not in done:
                return Step(
                    name=f"run_{log.runs}",
                    bench=bench,
                    seconds=options.run_length,
                    why=f"no cause is named yet; {excitation.replace('_', ' ')} may show one",
                    excitation=excitation,
                )
    return None


def reason_to_end(log: InvestigationLog, budget: float, length: float) -> str | None:
    """Return why nothing more is to be recorded; None where something is."""
    answered = [step for step in log.steps if step.probabilities is not None]
    if len(answered) > 1 and all(step.verdict == "no_gap" for step in answered[-2:]):
        return "nothing is left to explain, and a further run has not changed that"
    if log.seconds + length > budget:
        return f"{SPENT}: {log.seconds:.0f} s were recorded"
    return None


def nearest(
    found: Sequence[Expected], mounted: str, options: InvestigateOptions
) -> Expected | None:
    """Return the run that is worth most for its time; another bench takes a person's time."""
    change = 0.0 if options.port.startswith("virtual") else CHANGE_OF_BENCH

    def rate(expected: Expected) -> float:
        away = expected.plan.setting.bench != mounted
        return expected.told.worth / (options.run_length + change * away)

    return max(found, key=rate, default=None)
