"""Rates at which the diagnosis is right, over all answers of an exam."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import sqrt
from statistics import median
from typing import Any, get_args

from tendon_lab.exam.constant_answers import Drawn, fixed_marks, random_marks
from tendon_lab.exam.exam_score import Family, Mark

FAMILIES: tuple[Family, ...] = get_args(Family)
NORMAL = 1.645  # Quantile of a one-sided bound at 95 %


@dataclass(frozen=True, kw_only=True)
class Rate:
    """A share or a median over the cases of an exam."""

    name: str
    value: float
    cases: int  # Number of cases behind the figure
    at_least: float | None = None  # Lower bound of a share at 95 %, one-sided (Wilson) [1]
    fixed: float | None = None  # The same share of an answer that is always the same
    random: float | None = None  # The same share of answers at random


def rates(marks: Sequence[Mark], others: Drawn | None = None) -> tuple[Rate, ...]:
    """Return every figure that there are cases for, beside those of constant answers.

    Args:
        marks: All answers.
        others: Other truths of the same families, on which the fixed answer is chosen. By default
            it is chosen on these very truths: no fixed answer reaches more.
    """
    truths = [m.truth for m in marks]
    drawn: Drawn = others or {f: [t.effects for t in truths if t.family == f] for f in FAMILIES}
    fixed, random = (
        {rate.name: rate.value for rate in shares(made(truths, drawn))}
        for made in (fixed_marks, random_marks)
    )
    return tuple(
        replace(rate, fixed=fixed.get(rate.name), random=random.get(rate.name))
        for rate in figures_of(marks)
    )


def shares(marks: Sequence[Mark]) -> list[Rate]:
    """Return the figures that are shares."""
    return [rate for rate in figures_of(marks) if rate.at_least is not None]


def figures_of(marks: Sequence[Mark]) -> tuple[Rate, ...]:
    """Return every figure of some answers that there are cases for."""
    single = [m for m in marks if m.truth.family == "single" and not m.truth.weak]
    weak = [m for m in marks if m.truth.family == "single" and m.truth.weak]
    pairs = [m for m in marks if m.truth.family == "pair"]
    many = [m for m in marks if m.truth.family == "many"]
    clean = [m for m in marks if m.truth.family == "clean"]
    outside = [m for m in marks if m.truth.family == "outside"]
    known = [*single, *weak, *pairs, *many]
    figures: list[Rate] = []

    def add(name: str, cases: Sequence[Any], test: Callable[[Any], bool]) -> None:
        if cases:
            count(name, sum(map(test, cases)), len(cases))

    def count(name: str, hits: int, cases: int) -> None:
        if cases:
            bound = at_least(hits, cases)
            figures.append(Rate(name=name, value=hits / cases, cases=cases, at_least=bound))

    def middle(name: str, values: Sequence[float]) -> None:
        if values:
            figures.append(Rate(name=name, value=median(values), cases=len(values)))

    add("single: true cause named first", single, lambda m: m.exact)
    add("single: true cause first or in its class", single, lambda m: m.in_class)
    add("single: not confidently wrong", single, lambda m: not confidently_wrong(m))
    add("single: nothing else named", single, lambda m: len(m.said) == m.found)
    add("weak: true cause named first", weak, lambda m: m.exact)
    add("weak: true cause first or in its class", weak, lambda m: m.in_class)
    add("weak: silent", weak, lambda m: not m.said)
    add("clean: no cause named", clean, lambda m: not m.said)
    add("clean: verdict no_gap", clean, lambda m: m.verdict == "no_gap")
    add("outside: no wrong name", outside, lambda m: m.right)
    add("pair: both found", pairs, lambda m: m.found == 2)
    add("pair: nothing else named", pairs, lambda m: len(m.said) == m.found)
    found = sum(m.found for m in many)
    count("many: recall", found, sum(len(m.truth.effects) for m in many))
    count("many: precision", found, sum(len(m.said) for m in many))
    add("many: all found and nothing else", many, lambda m: not m.amiss)
    middle("parameters: relative error, median", [e for m in known for e in m.parameter_errors])
    add("parameters: 95 % interval holds the truth", [c for m in known for c in m.covered], bool)
    gains = [m.gain for m in known if m.gain is not None]
    middle("held-out gain over the true model's, median", gains)
    middle("seconds per dataset, median", [m.wall_time_s for m in marks])
    longest = max((m.wall_time_s for m in marks), default=0.0)
    figures.append(Rate(name="seconds per dataset, longest", value=longest, cases=len(marks)))
    memory = [m.peak_memory for m in marks if m.peak_memory is not None]
    if memory:
        figures.append(Rate(name="peak memory [MiB]", value=max(memory), cases=len(memory)))
    return tuple(figures)


def at_least(hits: int, cases: int) -> float:
    """Return the lower bound of a share at 95 %, one-sided (Wilson)."""
    share, spread = hits / cases, NORMAL**2 / cases
    half = sqrt(share * (1.0 - share) * spread + spread**2 / 4.0)
    return (share + spread / 2.0 - half) / (1.0 + spread)


def confidently_wrong(mark: Mark) -> bool:
    """Tell whether one cause was named, without a class, and wrongly."""
    return bool(mark.said) and not mark.in_class and len(mark.classes[0]) == 1
