"""What the search for a single cause found, as a diagnosis takes it: that of worn benches."""

from __future__ import annotations

from tendon_newton.data.model_file import Model
from tendon_newton.data.recording import Array
from tendon_newton.diagnosis.adequacy import is_noise
from tendon_newton.diagnosis.attribution import Attribution
from tendon_newton.diagnosis.findings import Findings, Found
from tendon_newton.diagnosis.gate import noise_loss
from tendon_newton.diagnosis.greedy import Fit, Search
from tendon_newton.diagnosis.result import CandidateScore, Verdict
from tendon_newton.identification.intervals import intervals
from tendon_newton.identification.least_squares import Candidate

LEAST_EXPLAINED = 0.5
"""Causes that explain less of the gap than this are not named: something else is the matter."""


def greedy_findings(search: Search, attribution: Attribution, model: Model) -> Findings:
    """Return an attribution as findings."""
    verdict, final = judge(search, attribution, model)
    baseline = found_of(search, attribution.rounds[0].current)
    closest = found_of(search, final or attribution.rounds[0].current)
    return Findings(
        verdict=verdict,
        baseline=baseline,
        final=None if final is None else closest,
        closest=closest,
        classes={
            effect: tuple((fit.effects[-1], found_of(search, fit)) for fit in rivals)
            for effect, rivals in attribution.classes.items()
        },
        candidates=candidate_scores(search, attribution),
    )


def found_of(search: Search, fit: Fit) -> Found:
    """Return a fit as the diagnosis takes it."""
    bounds = intervals(fit.candidate, fit.point, search.where)
    columns = fit.candidate.columns
    return Found(
        effects=fit.effects,
        values={c: float(v) for c, v in zip(columns, fit.candidate.value, strict=True)},
        intervals={c: (float(a), float(b)) for c, (a, b) in zip(columns, bounds, strict=True)},
        point=fit.point,
    )


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


def full_vector(search: Search, candidate: Candidate) -> Array:
    """Return the parameter vector with a candidate's values in place."""
    vector = search.study.table.null_vector()
    vector[list(candidate.columns)] = candidate.value
    return vector
