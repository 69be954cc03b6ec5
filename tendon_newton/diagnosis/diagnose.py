"""The whole diagnosis: from a dataset and a model to named causes and a measured gain."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tendon_newton.data.dataset import Dataset
from tendon_newton.data.model_file import Model, NamedValues
from tendon_newton.data.recording import Array
from tendon_newton.diagnosis.adequacy import is_noise
from tendon_newton.diagnosis.attribution import Attribution, attribute
from tendon_newton.diagnosis.evaluation import (
    SquaredErrors,
    evaluate_models,
    explained_fraction,
    fraction_interval,
)
from tendon_newton.diagnosis.explanation import (
    Explanation,
    OpenClass,
    model_without,
    settings_of,
)
from tendon_newton.diagnosis.gate import noise_loss
from tendon_newton.diagnosis.identifiability import Confounded, find_confounded, is_flat
from tendon_newton.diagnosis.next_experiment.separation import propose
from tendon_newton.diagnosis.result import (
    CandidateScore,
    Diagnosis,
    Estimate,
    NamedEffect,
    Unexplained,
    Verdict,
)
from tendon_newton.diagnosis.greedy import Fit, Search
from tendon_newton.diagnosis.unexplained.structure import find_structure
from tendon_newton.effects import EFFECTS, find_effect
from tendon_newton.identification.intervals import intervals
from tendon_newton.identification.least_squares import Candidate
from tendon_newton.identification.study import Study, refuse_several_tendons
from tendon_newton.identification.testable import testable_effects, untested_sides

SEARCH_STEP = 5.0e-4
"""Simulation step while searching [s]; the reported errors use the finer default."""
LEAST_EXPLAINED = 0.5
"""Causes that explain less of the gap than this are not named: something else is the matter."""
WORTH_SAYING = 0.1
"""Share of the gap from which a candidate at its bound is told in a sentence, not in the table
alone."""
SEED = 0
"""Of the surrogates and the bootstrap: the same data give the same diagnosis."""

Progress = Callable[[str], None]


@dataclass(frozen=True, kw_only=True)
class Evidence:
    """What a report shows besides the diagnosis."""

    baseline: dict[int, float]
    """Parameter column -> value of the starting model with its unknown numbers refitted."""
    extended: dict[int, float]
    """The same of the extended model."""
    test: Study
    """Held-out recordings."""
    train: Study
    """Recordings that the fits saw."""


def diagnose(
    dataset: Dataset, model: Model, *, progress: Progress = lambda _: None
) -> tuple[Diagnosis, Evidence]:
    """Name what a model gets wrong about a dataset.

    Args:
        dataset: Training recordings decide, test recordings only report.
        model: The model to start from.
        progress: Told, in a few words, what is being done.

    Raises:
        TendonNewtonError: The dataset or the model cannot be used; the message says why.
    """
    start = time.monotonic()
    rng = np.random.default_rng(SEED)
    refuse_several_tendons((*dataset.train, *dataset.test))
    progress("reading benches and compiling kernels")
    train = Study(dataset.train, model, tuple(EFFECTS), time_step=SEARCH_STEP, in_pieces=True)
    names = testable_effects(train)
    search = Search(train, model)
    progress(f"trying {len(names)} effects on {len(dataset.train)} recordings")
    attribution = attribute(search, names, [e.name for e in model.effects], train.noise, rng)
    progress("measuring the gain on held-out recordings")
    test = Study(dataset.test, model, tuple(EFFECTS))
    diagnosis, evidence = conclude(search, attribution, model, test, rng, start)
    return diagnosis, evidence


def conclude(
    search: Search,
    attribution: Attribution,
    model: Model,
    test: Study,
    rng: np.random.Generator,
    start: float,
) -> tuple[Diagnosis, Evidence]:
    """Turn an attribution into a verdict and measure it on the test recordings."""
    train = search.study
    baseline = values_of(attribution.baseline)
    verdict, final = judge(search, attribution, model)
    extended = baseline if final is None else values_of(final.candidate)
    without = [without_effect(search, extended, e) for e in effects_of(final)]
    before, after, *partial = evaluate_models(test, [baseline, extended, *without])
    fraction = explained_fraction(before.pooled(), after.pooled(), train.noise)
    low, high = fraction_interval(before, after, train.noise, rng)
    shown = final or attribution.rounds[0].current
    structure = find_structure(train, extended)
    scores = candidate_scores(search, attribution)
    diagnosis = Diagnosis(
        verdict=verdict,
        wall_time_s=time.monotonic() - start,
        baseline=before.pooled(),
        extended=after.pooled(),
        noise_force=train.noise.force,
        noise_theta=train.noise.theta,
        explained_fraction=fraction,
        explained_interval=(low, high),
        effects=named_effects(search, attribution, final, partial, model),
        candidates=scores,
        unexplained=Unexplained(
            fraction=remaining_fraction(verdict, fraction),
            depends_on=structure.depends_on
            if verdict in ("partly_explained", "unexplained")
            else (),
            structure=structure,
        ),
        model=extended_model(search, model, extended, effects_of(final)),
        p_value=attribution.p_value,
        fitted=fitted_numbers(search, shown),
        confounded=confounded_numbers(search, shown),
        scale=train.scale,
        recorded=settings_of(train.recordings),
        notes=(*notes(search), *ended_at_bounds(search, scores, effects_of(final))),
    )
    return diagnosis, Evidence(baseline=baseline, extended=extended, test=test, train=train)


def judge(search: Search, attribution: Attribution, model: Model) -> tuple[Verdict, Fit | None]:
    """Decide what the attribution is worth: named causes only if they account for the gap."""
    noise = search.study.noise
    first = attribution.rounds[0]
    known = [effect.name for effect in model.effects]
    quiet = is_noise(search, first.current, noise, known)
    final = attribution.final
    if final is None:
        return ("no_gap" if quiet else "unexplained"), None
    left = is_noise(search, final, noise, known)
    top = attribution.rounds[0].current
    floor = noise_loss(search, first, noise)
    rescored = search.score(
        [top.effects, final.effects], [top.candidate, final.candidate], first.scales
    )
    explained = (rescored[0].loss - rescored[1].loss) / max(rescored[0].loss - floor, 1.0e-12)
    if left:
        return "explained", final
    if explained < LEAST_EXPLAINED:
        return "unexplained", None
    return "partly_explained", final


def effects_of(final: Fit | None) -> tuple[str, ...]:
    """Return the named causes."""
    return () if final is None else final.effects


def values_of(candidate: Candidate) -> dict[int, float]:
    """Return parameter column -> value."""
    return {c: float(v) for c, v in zip(candidate.columns, candidate.value, strict=True)}


def without_effect(search: Search, extended: dict[int, float], effect: str) -> dict[int, float]:
    """Return the extended model with one effect back at the starting model's values."""
    own = search.study.table.columns(effect)
    return {c: (search.study.base_value(c) if c in own else v) for c, v in extended.items()}


def named_effects(
    search: Search,
    attribution: Attribution,
    final: Fit | None,
    without: list[SquaredErrors],
    model: Model,
) -> tuple[NamedEffect, ...]:
    """Describe the named causes."""
    if final is None:
        return ()
    bounds = intervals(final.candidate, final.point, search.where)
    described = []
    for effect, errors in zip(final.effects, without, strict=True):
        declared = find_effect(effect)
        rivals = attribution.classes.get(effect, ())
        question = open_class(search, final, effect, rivals, model) if rivals else None
        described.append(
            NamedEffect(
                name=effect,
                side=declared.side,
                parameters=estimates(
                    search, final.candidate, bounds, search.study.table.columns(effect)
                ),
                without=errors.pooled(),
                indistinguishable_from=tuple(fit.effects[-1] for fit in rivals),
                separating_experiment=propose(question)[0].text() if question else None,
                explanations=question.explanations if question else (),
            )
        )
    return tuple(described)


def open_class(
    search: Search, final: Fit, effect: str, rivals: Sequence[Fit], model: Model
) -> OpenClass:
    """Gather what an experiment must know that tells an effect from its rivals."""
    extended = extended_model(search, model, values_of(final.candidate), final.effects)
    pairs = [(effect, final), *((fit.effects[-1], fit) for fit in rivals)]
    return OpenClass(
        explanations=tuple(explain(search, fit, cause) for cause, fit in pairs),
        without=model_without(extended, effect),
        settings=settings_of(search.study.recordings),
        noise=search.study.noise,
        scale=search.study.scale,
    )


def explain(search: Search, fit: Fit, cause: str) -> Explanation:
    """Describe a fit by the cause that it stands for, and all its numbers."""
    bounds = intervals(fit.candidate, fit.point, search.where)
    table = search.study.table
    owners = dict.fromkeys(table.owners[column][0] for column in fit.candidate.columns)
    return Explanation(
        cause=cause,
        numbers={
            owner: estimates(search, fit.candidate, bounds, table.columns(owner))
            for owner in owners
        },
    )


def estimates(
    search: Search, candidate: Candidate, bounds: Array, columns: tuple[int, ...]
) -> dict[str, Estimate]:
    """Return the fitted numbers in some columns by name."""
    out = {}
    for place, column in enumerate(candidate.columns):
        if column in columns:
            parameter = search.study.parameter(column)
            value = float(candidate.value[place])
            ci95 = (float(bounds[place, 0]), float(bounds[place, 1]))
            out[parameter.name] = Estimate(
                value=value,
                ci95=ci95,
                unit=parameter.unit,
                at_bound=value in (parameter.lower, parameter.upper) and value != parameter.null,
                flat=is_flat(ci95, parameter.lower, parameter.upper),
            )
    return out


def fitted_numbers(search: Search, fit: Fit) -> dict[str, Estimate]:
    """Return the numbers of the model's ``fit`` list."""
    if not search.fit_columns:
        return {}
    bounds = intervals(fit.candidate, fit.point, search.where)
    return estimates(search, fit.candidate, bounds, search.fit_columns)


def confounded_numbers(search: Search, fit: Fit) -> tuple[Confounded, ...]:
    """Return the pairs of fitted numbers that the data cannot tell apart."""
    owners = [search.study.table.owners[column] for column in fit.candidate.columns]
    return find_confounded(fit.point, [f"{owner}.{p.name}" for owner, p in owners])


def candidate_scores(search: Search, attribution: Attribution) -> tuple[CandidateScore, ...]:
    """Return how every effect did alone, best first.

    Those that were not followed to the end have their coarse score.
    """
    first = attribution.rounds[0]
    floor = noise_loss(search, first, search.study.noise)
    above = max(first.current.loss - floor, 1.0e-12)
    scores = [
        CandidateScore(
            name=fit.effects[-1],
            score=(first.current.loss - fit.loss) / above,
            values=search.study.table.values(fit.effects[-1], full_vector(search, fit.candidate)),
            at_bound=first.ended[fit.effects[-1]],
        )
        for fit in first.fits
    ]
    followed = {score.name for score in scores}
    rest = sorted((loss, name) for name, loss in first.coarse.items() if name not in followed)
    scores += [
        CandidateScore(
            name=name,
            score=1.0 - loss / max(first.coarse_current, 1.0e-12),
            values={},
            at_bound=first.ended[name],
        )
        for loss, name in rest
    ]
    return tuple(scores)


def ended_at_bounds(
    search: Search, scores: Sequence[CandidateScore], named: Sequence[str]
) -> tuple[str, ...]:
    """Say which candidates would explain much if their ranges were wider."""
    table = search.study.table
    units = {(owner, p.name): p.unit for owner, p in table.owners}
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


def full_vector(search: Search, candidate: Candidate) -> Array:
    """Return the parameter vector with a candidate's values in place."""
    vector = search.study.table.null_vector()
    vector[list(candidate.columns)] = candidate.value
    return vector


def remaining_fraction(verdict: Verdict, fraction: float) -> float:
    """Return the share of the gap that is left; none where there is no gap."""
    return 0.0 if verdict == "no_gap" else float(np.clip(1.0 - fraction, 0.0, 1.0))


def extended_model(
    search: Search, model: Model, values: dict[int, float], effects: tuple[str, ...]
) -> Model:
    """Return the model with fitted numbers and named effects.

    An effect named again replaces its old entry.
    """
    table = search.study.table
    kept = [effect for effect in model.effects if effect.name not in effects]
    added = [
        NamedValues(
            name=name, values={table.owners[c][1].name: values[c] for c in table.columns(name)}
        )
        for name in effects
    ]
    return replace(search.study.with_fitted(model, values), effects=(*kept, *added))


def notes(search: Search) -> tuple[str, ...]:
    """Say what a reader must know before trusting the numbers."""
    out = list(untested_sides(search.study))
    recordings = search.study.recordings
    untrusted = sum(int((~search.study.timeline(i).trusted).sum()) for i in range(len(recordings)))
    if untrusted:
        out.append(
            f"{untrusted} rows were left out of the fits: after gaps in which the command jumped "
            "unseen, or where something solid held a servo's shaft."
        )
    return tuple(out)
