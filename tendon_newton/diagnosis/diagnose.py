"""The whole diagnosis: from a dataset and a model to named causes and a measured gain."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tendon_newton.data.dataset import Dataset
from tendon_newton.data.model_file import Model, NamedValues
from tendon_newton.data.parameters import Parameter
from tendon_newton.data.root_mean_square import rms
from tendon_newton.data.servo_names import effect_of, servo_of
from tendon_newton.diagnosis.accounts.checked_data import faults_of
from tendon_newton.diagnosis.accounts.next_steps import next_steps
from tendon_newton.diagnosis.accounts.suspect_data import plainly_wrong
from tendon_newton.diagnosis.evaluation import (
    SquaredErrors,
    evaluate_models,
    explained_fraction,
    fraction_interval,
    is_in_doubt,
    with_whole_recordings,
)
from tendon_newton.diagnosis.explanation import settings_of
from tendon_newton.diagnosis.findings import Findings, Found
from tendon_newton.diagnosis.identifiability import Confounded, find_confounded, is_flat
from tendon_newton.diagnosis.next_experiment.open_sets import OpenSets
from tendon_newton.diagnosis.next_experiment.planned_runs import settings_to_try
from tendon_newton.diagnosis.next_experiment.run_design import separating_run
from tendon_newton.diagnosis.posterior import FittedSet, Posterior
from tendon_newton.diagnosis.report_words import HARDLY_THERE
from tendon_newton.diagnosis.result import (
    CandidateScore,
    Diagnosis,
    Estimate,
    NamedEffect,
    Rival,
    Unexplained,
    Verdict,
)
from tendon_newton.diagnosis.richer_actuator import (
    is_doubted,
    left_over,
    promises,
    richer_actuator,
    says_more,
    with_actuator,
)
from tendon_newton.diagnosis.search.coordinates import is_shape
from tendon_newton.diagnosis.search.decide.account import OPEN
from tendon_newton.diagnosis.search.decide.find_causes import find_causes
from tendon_newton.diagnosis.search.search_worlds import SEARCH_STEP, WITHIN
from tendon_newton.diagnosis.time_left import (
    Progress,
    expectation,
    expected_times,
    finishing_time,
    measured_pace,
    notebook_progress,
)
from tendon_newton.diagnosis.unblocked import unblocked
from tendon_newton.diagnosis.unexplained.remainder_structure import find_structure
from tendon_newton.effects import EFFECTS, law_of
from tendon_newton.identification.study import Study, benches_of, replacements, servo_count
from tendon_newton.identification.testable import (
    stated_columns,
    testable_effects,
    too_little,
    untested_sides,
)
from tendon_newton.simulation.model.bench_numbers import OWNER

WORTH_SAYING = 0.1
"""Share of the gap from which a candidate at its bound is told in a sentence, not in the table
alone. Of causes that take less away from held-out recordings, or add less, these tell nothing."""
FAR = 0.999 * WITHIN  # Tolerances from which a stated number is off as far as it may be [1]
SEED = 0  # Seed of the bootstrap: the same data give the same diagnosis

NO_SMALLER = (
    "The causes that were found make the error on held-out recordings no smaller, so none is named."
)


@dataclass(frozen=True, kw_only=True)
class Evidence:
    """What a report shows besides the diagnosis."""

    baseline: dict[int, float]
    """Parameter column -> value of the starting model with its unknown numbers refitted."""
    extended: dict[int, float]  # Parameter column -> value of the extended model
    test: Study  # Held-out recordings
    train: Study  # Recordings that the fits saw


def diagnose(
    dataset: Dataset, model: Model, *, progress: Progress | None = None, budget: float | None = None
) -> tuple[Diagnosis, Evidence]:
    """Name what a model gets wrong about a dataset, its actuator among it.

    Args:
        dataset: Training recordings decide, test recordings report, and may take names back.
        model: The model to start from.
        progress: Told, in a few words, what is being done; by default a notebook shows it.
        budget: Time that the whole diagnosis may take, about [s], its report included.

    Raises:
        TendonNewtonError: The dataset or the model cannot be used; the message says why.
    """
    start = time.monotonic()
    progress = progress or notebook_progress()
    found, evidence = diagnose_as_stated(dataset, model, progress, budget)
    taken = time.monotonic() - start
    left = None if budget is None else budget - taken
    every = (*dataset.train, *dataset.test)
    richer = richer_actuator(model, every) if is_doubted(found) else None
    if richer is None or (left is not None and left < taken):
        return found, evidence
    progress(f"trying {richer.words}")
    stated = left_over(evidence.train, evidence.extended)
    study = search_study(unblocked(dataset)[0], richer.model)
    if not promises(richer, found, stated, study):
        return found, evidence
    other, seen = diagnose_as_stated(dataset, richer.model, progress, left)
    gain = stated - left_over(seen.train, seen.extended)
    if not says_more(found, other, gain, len(richer.numbers)):
        return found, evidence
    (before,) = evaluate_models(evidence.test, [evidence.baseline])
    (after,) = evaluate_models(seen.test, [seen.extended])
    told, noise = with_actuator(found, other, richer.numbers), seen.train.noise
    fraction = explained_fraction(before.pooled(), after.pooled(), noise)
    rest = remaining_fraction(told.verdict, fraction)
    told = replace(
        told,
        wall_time_s=time.monotonic() - start,
        explained_fraction=fraction,
        explained_interval=fraction_interval(before, after, noise, np.random.default_rng(SEED)),
        unexplained=replace(told.unexplained, fraction=rest),
    )
    return told, seen


def diagnose_as_stated(
    dataset: Dataset, model: Model, progress: Progress, budget: float | None
) -> tuple[Diagnosis, Evidence]:
    """Name what a model gets wrong about a dataset, its actuator's kind as it is stated."""
    start = time.monotonic()
    rng = np.random.default_rng(SEED)
    every = (*dataset.train, *dataset.test)
    servo_count(every, benches_of(every, model))
    dataset, blocked = unblocked(dataset)
    for text in blocked:
        progress(text)
    progress("reading benches")
    train = search_study(dataset, model)
    faults = faults_of(dataset.train)
    names, little = testable_effects(train), too_little(dataset.train, train.noise)
    suspects = plainly_wrong(train, model) if little is None else ()
    wrong = (little,) if little is not None else tuple(suspect.text for suspect in suspects)
    untold = little is not None or any(suspect.stops for suspect in suspects)
    names = () if untold else names
    for text in wrong:
        progress(text)
    pace = measured_pace(dataset.train, model, train)
    last = finishing_time(dataset, pace)
    expected = expectation(*(last + t for t in expected_times(dataset.train, train, pace)))
    progress(f"looking at {len(names)} effects on {len(dataset.train)} recordings, {expected}")
    if budget is not None:
        budget = max(0.0, budget - last - (time.monotonic() - start))
    still = "warn" if little is None else "ignore"  # where all rows rest, none has a weight
    with np.errstate(divide=still, invalid=still):
        findings = find_causes(
            dataset.train, train, model, names, progress=progress, budget=budget, pace=pace
        )
    if not findings.final and within_a_count(train):
        findings = replace(findings, verdict="no_gap", predictor=None)
    elif untold:
        findings = replace(findings, verdict="unexplained", nameless="unexplained")
    progress("measuring the gain on held-out recordings")
    if findings.predictor is not None:
        whole = Study(dataset.train, model, tuple(EFFECTS), like=train)
        findings = with_whole_recordings(findings, whole, rng)
    test = Study(dataset.test, model, tuple(EFFECTS), like=train)
    diagnosis, evidence = conclude(train, findings, model, test, rng, start)
    steps = ()
    if not untold and not faults:
        steps = next_steps(diagnosis, dataset, model, train, findings.closest.values)
    told = replace(
        diagnosis, next_steps=(*faults, *wrong, *steps), notes=(*blocked, *diagnosis.notes)
    )
    return told, evidence


def search_study(dataset: Dataset, model: Model) -> Study:
    """Return the training recordings with all effects, as a search simulates them."""
    return Study(
        dataset.train, model, tuple(EFFECTS), time_step=SEARCH_STEP, in_segments=True, tolerant=True
    )


def within_a_count(study: Study) -> bool:
    """Tell whether the starting model errs nowhere by more than an encoder can tell.

    Command and angle are each off by half a count, whose noise is a twelfth of its square.
    """
    count = study.noise.theta * np.sqrt(12.0)
    residuals = study.residuals(*replacements([{}]))
    force = [r.force[0, r.trusted] for r in residuals if r.force is not None]
    told = study.noise.force is None or not force or rms(np.concatenate(force)) <= study.noise.force
    return told and all(np.abs(r.theta[0, r.trusted]).max(initial=0.0) <= count for r in residuals)


def numbers_of(effect: NamedValues) -> dict[str, float]:
    """Return the numbers of an effect by name."""
    return {name: value for name, value in effect.values.items() if not isinstance(value, str)}


@dataclass(frozen=True, kw_only=True)
class HeldOutErrors:
    """Errors of the models behind an answer on the test recordings."""

    before: SquaredErrors  # Of the starting model, its unknown numbers refitted
    after: SquaredErrors  # Of what is written
    partial: Sequence[SquaredErrors]  # Without each cause, see `causes_of`
    plain: Sequence[SquaredErrors]  # Of each plain model
    fraction: float  # Share of the gap that is gone [1]


def conclude(
    train: Study,
    findings: Findings,
    model: Model,
    test: Study,
    rng: np.random.Generator,
    start: float,
) -> tuple[Diagnosis, Evidence]:
    """Put findings into a diagnosis and measure them on the test recordings."""
    findings, measured = helpful(train, findings, test, rng)
    final, written = findings.final, findings.written
    before, after = measured.before, measured.after
    interval = fraction_interval(before, after, train.noise, rng)
    found = described(train, findings, causes_of(findings), measured.partial, model)
    named = tuple(cause for cause in found if not cause.reason)
    verdict = findings.verdict if named or final is None else "unexplained"
    less = [errors for c, errors in zip(found, measured.partial, strict=True) if not c.reason]
    if verdict == "explained" and is_in_doubt(
        before, after, less, measured.plain, train.noise, interval[1]
    ):
        verdict = "partly_explained"
    extended, is_left = dict(written.values), verdict in ("partly_explained", "unexplained")
    structure = find_structure(train, extended) if is_left else None
    diagnosis = Diagnosis(
        verdict=verdict,
        wall_time_s=time.monotonic() - start,
        finished=findings.finished,
        baseline=before.pooled(),
        extended=after.pooled(),
        noise_force=train.noise.force,
        noise_theta=train.noise.theta,
        noise_others=train.noise.others,
        explained_fraction=measured.fraction,
        explained_interval=interval,
        effects=named,
        suspected=tuple(cause for cause in found if cause.reason),
        rivals=rivals(findings, written.effects, after, measured.plain),
        posterior=findings.posterior,
        candidates=findings.candidates,
        unexplained=Unexplained(
            fraction=remaining_fraction(verdict, measured.fraction),
            depends_on=() if structure is None else structure.depends_on,
            structure=structure,
        ),
        model=extended_model(train, model, extended, written.effects),
        fitted=estimates(train, written, train.fit_columns(model)),
        confounded=confounded_numbers(train, final or findings.baseline),
        scale=train.scale,
        servos=train.servos,
        start={e.cause: numbers_of(e) for e in model.effects},
        recorded=settings_of(train.wholes),
        notes=notes(train, test, findings),
    )
    return diagnosis, Evidence(
        baseline=dict(findings.baseline.values), extended=extended, test=test, train=train
    )


def helpful(
    train: Study, findings: Findings, test: Study, rng: np.random.Generator
) -> tuple[Findings, HeldOutErrors]:
    """Return findings without what test recordings do not bear out, and the errors there.

    Numbers that are only suspected go first, then all names, where the error is no smaller. Names
    stay if it is surely not much larger with them nor much smaller without: held-out recordings
    need not show a cause.

    Args:
        train: The recordings that the fits saw.
        findings: What was found there.
        test: Held-out recordings.
        rng: Draws the recordings of an interval.
    """
    if findings.nameless == "no_gap" and not any(
        is_named(findings, c) for c in causes_of(findings)
    ):
        findings = replace(
            findings, verdict="no_gap", final=None, predictor=None, posterior=Posterior()
        )
    measured = measure(train, findings, test)
    if measured.fraction > 0.0:
        return findings, measured
    if findings.predictor is not None:
        return helpful(train, replace(findings, predictor=None), test, rng)
    if findings.final is None:
        return findings, measured
    least, _ = fraction_interval(measured.before, measured.after, train.noise, rng)
    _, most = fraction_interval(measured.after, measured.before, train.noise, rng)
    if least > -WORTH_SAYING and most < WORTH_SAYING:
        return replace(findings, notes=(*findings.notes, HARDLY_THERE)), measured
    empty = replace(
        findings, verdict="unexplained", final=None, posterior=Posterior(),
        notes=(*findings.notes, NO_SMALLER),
    )  # fmt: skip
    return helpful(train, empty, test, rng)


def measure(train: Study, findings: Findings, test: Study) -> HeldOutErrors:
    """Return the errors on test recordings of all models behind an answer."""
    causes = causes_of(findings)
    without = [without_effect(train, found.values, cause) for cause, found in causes.items()]
    plain = [model.values for model in findings.plain]
    before, after, *others = evaluate_models(
        test, [findings.baseline.values, findings.written.values, *without, *plain]
    )
    return HeldOutErrors(
        before=before,
        after=after,
        partial=others[: len(without)],
        plain=others[len(without) :],
        fraction=explained_fraction(before.pooled(), after.pooled(), train.noise),
    )


def rivals(
    findings: Findings, named: Sequence[str], after: SquaredErrors, others: Sequence[SquaredErrors]
) -> tuple[Rival, ...]:
    """Return an answer beside plain models, best on unseen parts first; none if it is alone."""
    out = [
        Rival(
            name=model.name, effects=model.effects, held_out=model.held_out, errors=errors.pooled(),
        )
        for model, errors in zip(findings.plain, others, strict=True)
        if set(model.effects) != set(named)
    ]  # fmt: skip
    if findings.predicts is None or not out:
        return ()
    answer = Rival(
        name="this answer", effects=tuple(named), held_out=findings.predicts,
        errors=after.pooled(), chosen=True,
    )  # fmt: skip
    return tuple(sorted((answer, *out), key=lambda rival: rival.held_out))


def causes_of(findings: Findings) -> dict[str, Found]:
    """Return the named and suspected causes, each with the set in which it was found."""
    causes = dict[str, Found]()
    for found in (findings.final, findings.predictor):
        if found is not None:
            causes |= {cause: found for cause in found.effects if cause not in causes}
    return causes


def why_suspected(findings: Findings, cause: str) -> str:
    """Return why a cause is not named, as a sentence; empty for one that is."""
    if findings.final is None:
        return "No cause is sure; of all sets that were fitted its one predicts unseen parts best."
    if cause not in findings.criteria:
        return "It helps to predict unseen parts, by less than a name costs."
    if cause not in findings.suspected:
        return ""
    if any(c.name == OPEN and not c.passed for c in findings.criteria[cause]):
        return "Its interval holds the value that means nothing."
    return "It is worth little beside what no cause explains."


def is_named(findings: Findings, cause: str) -> bool:
    """Tell whether a cause is named, and not only suspected."""
    return findings.final is not None and not why_suspected(findings, cause)


def without_effect(study: Study, extended: Mapping[int, float], effect: str) -> dict[int, float]:
    """Return the extended model with one effect back at the starting model's values."""
    own = study.table.columns(effect)
    return {c: (study.base_value(c) if c in own else v) for c, v in extended.items()}


def described(
    study: Study,
    findings: Findings,
    causes: Mapping[str, Found],
    without: Sequence[SquaredErrors],
    model: Model,
) -> tuple[NamedEffect, ...]:
    """Describe the named and the suspected causes."""
    out = []
    for (effect, found), errors in zip(causes.items(), without, strict=True):
        rivals = findings.classes.get(effect, ())
        proposal = None
        if rivals and study.takes_commands:
            settings = settings_to_try(settings_of(study.wholes), None)
            sets = open_sets(study, (found, *(rival for _, rival in rivals)), model)
            proposal = separating_run(sets, settings, (effect, *(name for name, _ in rivals)))
        out.append(
            NamedEffect(
                name=effect,
                side=law_of(effect).side,
                parameters=estimates(study, found, study.table.columns(effect)),
                without=errors.pooled(),
                indistinguishable_from=tuple(name for name, _ in rivals),
                separating_experiment=proposal,
                criteria=findings.criteria.get(effect, ()),
                reason=why_suspected(findings, effect),
                probability=findings.probabilities.get(effect),
            )
        )
    return tuple(out)


def open_sets(study: Study, fits: Sequence[Found], model: Model) -> OpenSets:
    """Gather what an experiment must know that tells sets of causes apart, all equally likely."""
    sets = (
        FittedSet(weight=1.0, causes=f.effects, numbers=f.numbers, covariance=f.covariance)
        for f in fits
    )
    return OpenSets(
        posterior=Posterior(sets=tuple(sets)), model=model, noise=study.noise, scale=study.scale
    )


def estimates(study: Study, found: Found, columns: Sequence[int]) -> dict[str, Estimate]:
    """Return the fitted numbers in some columns by name; not those that a law is without."""
    out = {}
    for column, value in found.values.items():
        parameter = study.parameter(column)
        if column in columns and not (parameter.optional and value == parameter.null):
            ci95 = found.intervals[column]
            out[parameter.name] = Estimate(
                value=value,
                ci95=ci95,
                unit=parameter.unit,
                at_bound=value in (parameter.lower, parameter.upper) and value != parameter.null,
                flat=is_flat(ci95, parameter.lower, parameter.upper),
                null=null_of(parameter, lone=len(columns) == 1),
            )
    return out


def null_of(parameter: Parameter, *, lone: bool) -> float | None:
    """Return the value at which a number means nothing; None if it only shapes beside others."""
    is_size = lone or not is_shape(parameter)
    return min(parameter.null, parameter.upper) if is_size else None


def confounded_numbers(study: Study, found: Found) -> tuple[Confounded, ...]:
    """Return the pairs of fitted numbers that the data cannot tell apart."""
    owners = [study.table.owners[column] for column in found.values]
    pairs = find_confounded(found.point, [f"{owner}.{p.name}" for owner, p in owners])
    built = {f"{OWNER}.{number.name}" for number in study.tolerated}
    built |= {f"{o}.{p.name}" for o, p in
              (study.table.owners[c] for c in undoubted_columns(study, found.effects))}  # fmt: skip
    return tuple(pair for pair in pairs if not built & {pair.first, pair.second})


def undoubted_columns(study: Study, effects: Sequence[str]) -> tuple[int, ...]:
    """Return the stated numbers of effects that are no causes, which differ as any bench does."""
    owners = study.table.owners
    return tuple(c for c in stated_columns(study) if owners[c][0] not in effects)


def as_built(study: Study, found: Found) -> tuple[str, ...]:
    """Say which stated numbers are surely not what was stated, and which are off as far as may be.

    A number that ended there may hide a cause: of it alone too little is known for a name.
    """
    told, far = list[str](), list[str]()
    benches = study.tolerated_columns
    for column in (*benches, *undoubted_columns(study, found.effects)):
        number, stated = study.parameter(column), study.base_value(column)
        if column not in found.values or not number.tolerance:
            continue
        change = found.values[column] / stated - 1.0 if stated else found.values[column]
        off = np.log1p(change) / np.log1p(number.tolerance) if stated else change / number.tolerance
        low, high = found.intervals[column]
        if low <= stated <= high and abs(off) < FAR:
            continue
        name = number.name if column in benches else study.table.owners[column][0]
        told.append(f"{name} {100.0 * change:+.1f} %" if stated
                    else f"{name} {change:+.3g} {number.unit}")  # fmt: skip
        far += [name] if abs(off) >= FAR else []
    if not told:
        return ()
    text = (
        "A bench may differ a little from its drawing, data sheet and calibration, and any gear "
        "gives way a little before it slides. No cause is named for that. Fitted: "
        f"{', '.join(told)}. The model has all such numbers."
    )
    return (f"{text} Measure {', '.join(far)}: nothing stated is so far off." if far else text,)


def of_each_bench(study: Study, found: Found) -> tuple[str, ...]:
    """Say how many times as much of a line's effects further benches surely have as the first."""
    told = []
    for column in study.line_columns(found.effects):
        low, high = found.intervals[column]
        if not low <= 1.0 <= high:
            value, name = found.values[column], study.parameter(column).name
            told.append(f"{name} {value:.3g} times [{low:.3g}, {high:.3g}]")
    if not told:
        return ()
    first = study.wholes[0].bench
    return (
        f"Each bench has its own line. What is said of a line is that of {first}; others have "
        f"{', '.join(told)}. The model's bench_overrides have all such numbers.",
    )


def ended_at_bounds(
    study: Study, scores: Sequence[CandidateScore], named: Sequence[str]
) -> tuple[str, ...]:
    """Say which candidates would explain much if their ranges were wider."""
    units = {(owner, p.name): p.unit for owner, p in study.table.owners}
    return tuple(
        f"{score.name} is at its bound ("
        + ", ".join(
            f"{name} = {value:.3g} {units[score.name, name].removesuffix('1')}".rstrip()
            for name, value in score.at_bound.items()
        )
        + f") and so cannot be named; alone it removes {100.0 * score.score:.0f} % of the gap."
        for score in scores
        if score.at_bound and score.name not in named and score.score > WORTH_SAYING
    )


def remaining_fraction(verdict: Verdict, fraction: float) -> float:
    """Return the share of the gap that is left; none where there is no gap."""
    return 0.0 if verdict == "no_gap" else float(np.clip(1.0 - fraction, 0.0, 1.0))


def extended_model(
    study: Study, model: Model, values: Mapping[int, float], effects: Sequence[str]
) -> Model:
    """Return the model with fitted numbers and named effects.

    An effect named again replaces its old entry, or takes it away where its first number ended at
    none. Any other infinite number is written as the end of its range: a file holds none.
    """
    table = study.table
    owners = [table.owners[c][0] for c in undoubted_columns(study, effects) if c in values]
    effects = (*effects, *owners)
    kept = [effect for effect in model.effects if effect.cause not in effects]
    added = []
    for name in effects:
        numbers = [(table.owners[c][1], values[c]) for c in table.columns(name)]
        numbers = [(p, value) for p, value in numbers if not p.optional or value != p.null]
        if numbers[0][1] != numbers[0][0].null:
            finite = {p.name: value if np.isfinite(value) else p.upper for p, value in numbers}
            added.append(NamedValues(name=effect_of(name), servo=servo_of(name), values=finite))
    return replace(study.with_fitted(model, values), effects=(*kept, *added))


def notes(study: Study, test: Study, findings: Findings) -> tuple[str, ...]:
    """Say what a reader must know before trusting the numbers."""
    out = list(untested_sides(study))
    for view in study.views:
        joints, count = view.recording.joint_position, len(view.mechanism.joints)
        if joints is not None and joints.shape[1] != count:
            out.append(
                f"joint_angle of {view.recording.name} has {joints.shape[1]} columns and its bench "
                f"{count} joints, so it was not compared: record every joint."
            )
            break
    untrusted = [
        sum(int((~s.timeline(i).trusted).sum()) for i in range(len(s.recordings)))
        for s in (study, test)
    ]
    if any(untrusted):
        out.append(
            f"{untrusted[0]} rows were left out of the fits and {untrusted[1]} of the held-out "
            "error: after gaps in which the command jumped unseen, or where something solid held a "
            "servo's shaft."
        )
    written = findings.written
    bounds = ended_at_bounds(study, findings.candidates, written.effects)
    told = (*as_built(study, written), *of_each_bench(study, written), *bounds)
    return (*out, *told, *findings.notes)
