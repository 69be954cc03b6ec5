"""Choose the next run of an investigation, or say why there is none."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from tendon_hardware.control.operator import Operator
from tendon_newton.data.dataset import load_dataset
from tendon_newton.data.excitations import DESIGNED, EXCITATIONS
from tendon_newton.diagnosis.explanation import OpenClass, Setting
from tendon_newton.diagnosis.next_experiment.expected_run import Expected, plan_of
from tendon_newton.diagnosis.next_experiment.investigation_log import InvestigationLog, Step
from tendon_newton.diagnosis.next_experiment.open_class_file import read_answer, read_open_class
from tendon_newton.diagnosis.next_experiment.run_design import design
from tendon_newton.diagnosis.next_experiment.worst_case import Designs
from tendon_newton.workflows.options import InvestigateOptions

RECORDINGS = "recordings"
"""Folder of the dataset in that of an investigation."""
CHANGE_OF_BENCH = 60.0
"""Time that it takes a person to mount another bench [s]; a virtual one is there at once."""
FORCE_SHARE = 0.8
"""Share of the tension limit that no designed run may reach in simulation [1]."""
LITTLE = 0.5
"""A run that is expected to bring less is not worth its time [bit]."""
IDLE = 2
"""Runs in a row after which an investigation that learns nothing ends."""
SPENT = "the time at the bench is spent"
"""Beginning of the reason that a larger budget removes."""


@dataclass(frozen=True, kw_only=True)
class NextRun:
    """What to record, and why."""

    expected: Expected
    why: str


def choose_next(
    log: InvestigationLog, options: InvestigateOptions, operator: Operator, budget: float
) -> InvestigationLog:
    """Add the run that is expected to bring the most, or say why there is none."""
    reason = reason_to_end(log, budget, options.run_length)
    if reason is not None:
        return replace(log, ended=reason)
    step = None if log.steps[-1].causes else library_run(log, options)
    if step is None:
        chosen = next_run(log, options, operator)
        if isinstance(chosen, str):
            return replace(log, ended=chosen + still_open(log.steps[-1]))
        plan = chosen.expected.prediction.plan
        step = Step(
            name=f"run_{log.runs}",
            bench=plan.setting.bench,
            seconds=options.run_length,
            why=chosen.why,
            excitation=DESIGNED,
            command=tuple(np.round(plan.command, 4).tolist()),
            expected={k: round(v, 3) for k, v in chosen.expected.numbers.items()},
        )
    return replace(log, steps=(*log.steps, step))


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
    last = log.steps[-1]
    diagnosed = [step for step in log.steps if step.verdict is not None]
    changed = [
        set(now.causes or {}) != set(before.causes or {}) or not now.taught_nothing(LITTLE)
        for before, now in pairwise(diagnosed)
    ]
    stays = len(diagnosed) > 1 and set(last.causes or {}) == set(diagnosed[-2].causes or {})
    if stays and last.verdict in ("no_gap", "explained") and not last.open:
        return "every cause stands alone, and a further run has not changed that"
    if log.seconds + length > budget:
        return f"{SPENT}: {log.seconds:.0f} s were recorded" + still_open(last)
    if last.causes and len(changed) >= IDLE and not any(changed[-IDLE:]):
        return f"the last {IDLE} runs brought nothing new" + still_open(last)
    return None


def still_open(step: Step) -> str:
    """Return what a step leaves open, in words."""
    if not step.open:
        return ""
    pairs = "; ".join(" or ".join(names) for names in step.open)
    return f"; left open: {pairs}. Another load, spring or posture may tell them apart"


def next_run(
    log: InvestigationLog, options: InvestigateOptions, operator: Operator
) -> NextRun | str:
    """Return the run that tells a class apart, or else the one that narrows intervals most.

    Where there is none, return why.
    """
    folder = options.out / f"diagnosis_{log.runs}"
    known = [plan_of(r) for r in load_dataset(options.out / RECORDINGS).train]
    settings = [Setting(bench=bench) for bench in options.benches]
    rng = np.random.default_rng([options.seed, log.runs])

    def best(question: OpenClass) -> tuple[Expected | None, Designs]:
        found = design(
            question,
            known,
            settings,
            rng,
            duration=options.run_length,
            force_limit=FORCE_SHARE * options.force_limit,
            progress=lambda text: operator.announce(f"  next run: {text}"),
        )
        return nearest(found.runs, log.steps[-1].bench, options), found

    tried: list[Expected] = []
    for names in log.steps[-1].open:
        expected, _ = best(read_open_class(folder, names[0]))
        if expected is not None and expected.settles > 0.0:
            return NextRun(expected=expected, why=f"to tell {' from '.join(names)}")
        tried += [] if expected is None else [expected]
    if not tried:
        expected, found = best(read_answer(folder))
        if expected is None:
            return (
                f"every run that was tried may pull harder than {FORCE_SHARE:.0%} of --force-limit "
                f"{options.force_limit:g} N under some model that the data allow, the calmest with "
                f"{min(found.refused):.3g} N"
            )
        tried.append(expected)
    expected = max(tried, key=lambda e: e.bits)
    if expected.bits < LITTLE:
        return "no run on these benches is expected to tell more"
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
