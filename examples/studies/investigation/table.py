"""What many results come to: causes, classes, time at the bench, and information run by run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from examples.studies.investigation.one_unit import INVESTIGATE, WAYS, Answer, Result

EQUALS = {"gear_load_friction": "load_dependent_friction"}
"""Names of a diagnosis for what a unit's file calls otherwise."""
FACTOR = 2.0
"""Within which information that came counts as predicted [1]."""


@dataclass(frozen=True, kw_only=True)
class Score:
    """An answer held against what was planted."""

    planted: frozenset[str]
    """Planted causes that are named."""
    own: tuple[str, ...]
    """Further names that the unit has of its own."""
    wrong: tuple[str, ...]
    """Names of what it does not have."""


def score(result: Result, answer: Answer) -> Score:
    """Hold an answer against the truth."""
    further = [name for name in answer.named if name not in result.planted]
    own = [name for name in further if EQUALS.get(name, name) in result.true]
    return Score(
        planted=frozenset(result.planted.keys() & set(answer.named)),
        own=tuple(own),
        wrong=tuple(name for name in further if name not in own),
    )


def unit_table(results: Sequence[Result]) -> str:
    """Return a row for the last answer of each result."""
    lines = ["unit  way          bench  planted  own  wrong  classes  verdict  the end; names"]
    for result in sorted(results, key=lambda r: (r.unit, WAYS.index(r.way))):
        if not result.answers:
            continue
        last = result.answers[-1]
        own = score(result, last)
        unfinished = "" if last.finished else " (unfinished)"
        lines.append(
            f"{result.unit:4d}  {result.way:11s} {last.bench_seconds:5.0f} s  "
            f"{len(own.planted)} of {len(result.planted)}  {len(own.own):3d}  {len(own.wrong):5d}  "
            f"{len(last.classes):7d}  {last.verdict}{unfinished}  {result.ended or 'goes on'}; "
            f"{', '.join(last.named) or 'none'}"
        )
    return "\n".join(lines)


def same_answer(result: Result, fixed: Result) -> Answer | None:
    """Return the first answer that is as good as that of a fixed plan; None without one.

    It names the planted causes that the plan named, no more wrong ones, and leaves no more classes.
    """
    last = fixed.answers[-1]
    goal = score(fixed, last)
    for answer in result.answers:
        own = score(result, answer)
        if (
            own.planted >= goal.planted
            and len(own.wrong) <= len(goal.wrong)
            and len(answer.classes) <= len(last.classes)
        ):
            return answer
    return None


def is_dissolved(names: Sequence[str], answer: Answer) -> bool:
    """Tell whether an answer names one of a class, and leaves no two of it side by side."""
    together = [set(own) & set(names) for own in answer.classes]
    return any(name in answer.named for name in names) and all(len(t) < 2 for t in together)


def comparison(results: Sequence[Result], way: str) -> str:
    """Return how investigations do against a fixed plan on the same units."""
    found = {(r.unit, r.way): r for r in results if r.answers}
    units = [u for u, w in found if w == way and (u, INVESTIGATE) in found]
    if not units:
        return f"against {way}: no unit has both"
    lines = [f"against {way}:"]
    halves = dissolved = classes = right = fixed_right = wrong = fixed_wrong = 0
    for unit in sorted(units):
        own, fixed = found[unit, INVESTIGATE], found[unit, way]
        last, theirs = own.answers[-1], fixed.answers[-1]
        same = same_answer(own, fixed)
        gone = sum(is_dissolved(names, last) for names in theirs.classes)
        dissolved, classes = dissolved + gone, classes + len(theirs.classes)
        halves += same is not None and same.bench_seconds <= 0.5 * theirs.bench_seconds
        mine, goal = score(own, last), score(fixed, theirs)
        right, fixed_right = right + len(mine.planted), fixed_right + len(goal.planted)
        wrong, fixed_wrong = wrong + len(mine.wrong), fixed_wrong + len(goal.wrong)
        after = "never" if same is None else f"after {same.bench_seconds:.0f} s"
        lines.append(
            f"  unit {unit}: as much {after} of {theirs.bench_seconds:.0f} s; planted "
            f"{len(mine.planted)} against {len(goal.planted)}, wrong {len(mine.wrong)} against "
            f"{len(goal.wrong)}; {gone} of {len(theirs.classes)} classes dissolved"
        )
    lines.append(
        f"  {len(units)} units: as much in half the time on {halves}; planted causes named "
        f"{right} against {fixed_right}, wrong ones {wrong} against {fixed_wrong}; "
        f"{dissolved} of {classes} classes dissolved"
    )
    return "\n".join(lines)


def information(results: Sequence[Result]) -> str:
    """Return information expected and brought, run by run, about numbers of both diagnoses."""
    lines = ["run by run, bits expected and brought about the numbers of both diagnoses:"]
    within: list[bool] = []
    kept: list[bool] = []
    for result in sorted(results, key=lambda r: r.unit):
        before: Answer | None = None
        for answer in result.answers:
            both = sorted(answer.expected.keys() & answer.brought.keys())
            if both and before is not None:
                expected, came = (
                    sum(bits[k] for k in both) for bits in (answer.expected, answer.brought)
                )
                good = bool(expected > 0.0 and expected / FACTOR <= came <= FACTOR * expected)
                same = set(before.named) == set(answer.named)
                within.append(good)
                kept.append(same)
                lines.append(
                    f"  unit {result.unit} {answer.run:24s} {expected:5.1f} {came:6.1f}  "
                    f"{len(both):2d} numbers  {'within' if good else 'beyond'} a factor of "
                    f"{FACTOR:g}  {'same names' if same else 'other names'}"
                )
            before = answer
    if not within:
        return "no run has information expected and brought"
    own = np.array(within)
    same = own[np.array(kept)]
    lines.append(
        f"  {own.sum()} of {len(own)} runs within a factor of {FACTOR:g}; where the names stayed "
        f"{same.sum()} of {len(same)}"
    )
    return "\n".join(lines)
