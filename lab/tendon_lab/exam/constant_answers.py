"""What an answer reaches that opens no file: a rate says something only above that.

A *fixed* answer has the names that stood most often in other truths of the same family, dealt to
classes of three, as many as a set of that family has causes; it says *no gap* of a family without a
cause and *unexplained* of one outside the catalogue. A *random* answer draws as many of the whole
catalogue for each set. Of a bench with many faults a fixed answer names the three that stand for
most faults that matter on the other benches of the exam.
"""

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from math import comb
from statistics import mean, median_high
from typing import Any

import numpy as np

from tendon_lab.exam.exam_score import LARGEST_CLASS, Family, Mark, Truth
from tendon_newton.effects import EFFECTS

DRAWS = 50  # Random answers to each set, whose mean is told
NAMES = 3  # Names of a constant answer to a bench with many faults
VERDICTS: Mapping[str, str] = {"clean": "no_gap", "outside": "unexplained"}
"""What a fixed answer says of a family that has no cause to be named."""
Drawn = Mapping[Family, Sequence[Collection[str]]]  # Names that are right in truths of a family


def fixed_marks(truths: Sequence[Truth], others: Drawn) -> list[Mark]:
    """Return the marks of the fixed answer to each truth, chosen on other truths."""
    said = {
        family: classes_of(most_frequent(own, LARGEST_CLASS * size_of(own)), size_of(own))
        for family, own in others.items()
    }
    return [mark(truth, said.get(truth.family, ())) for truth in truths]


def random_marks(truths: Sequence[Truth], others: Drawn) -> list[Mark]:
    """Return the marks of several random answers to each truth."""
    rng = np.random.default_rng(0)
    out: list[Mark] = []
    for truth in [*truths] * DRAWS:
        size = max(1, size_of(others.get(truth.family, ())))
        names = list(map(str, rng.choice([*EFFECTS], LARGEST_CLASS * size, replace=False)))
        out.append(mark(truth, classes_of(names, size)))
    return out


def size_of(truths: Sequence[Collection[str]]) -> int:
    """Return how many causes a set of some truths has, as a rule."""
    return median_high(map(len, truths)) if truths else 0


def most_frequent(truths: Sequence[Collection[str]], count: int) -> list[str]:
    """Return the names that stand in most truths; of equal ones the first of the catalogue."""
    seen = Counter(name for names in truths for name in names)
    return sorted(EFFECTS, key=lambda name: -seen[name])[:count]


def classes_of(names: Sequence[str], size: int) -> tuple[tuple[str, ...], ...]:
    """Deal names to classes."""
    return tuple(tuple(names[k::size]) for k in range(size))


def mark(truth: Truth, classes: tuple[tuple[str, ...], ...]) -> Mark:
    """Return the mark of an answer that states no number."""
    return Mark(
        truth=truth, said=tuple(names[0] for names in classes), classes=classes,
        verdict="explained" if classes else VERDICTS.get(truth.family, "no_gap"),
        wall_time_s=0.0, parameter_errors=(), covered=(),
    )  # fmt: skip


def reached(plants: Sequence[Collection[str]], faults: Sequence[Collection[str]]) -> dict[str, Any]:
    """Return what constant answers reach on benches with many faults.

    Args:
        plants: Names that are right for something, on each bench.
        faults: Faults that matter, on each bench: names that are right for one, joined by a blank.

    Returns:
        ``names`` that stand for most faults, ``in_plant`` and ``faults``: shares of the names that
        are right and of the faults that are named [1]: ``fixed`` names chosen on the other benches,
        a ``random`` name or for faults three of them, and a random ``class`` of three names.
    """
    right, found = list[bool](), list[bool]()
    for k, (plant, own) in enumerate(zip(plants, faults, strict=True)):
        names = standing_for([*faults[:k], *faults[k + 1 :]])
        right += [name in plant for name in names]
        found += [not set(fault.split()).isdisjoint(names) for fault in own]
    each = [len(fault.split()) for own in faults for fault in own]
    return {
        "names": standing_for(faults),
        "in_plant": {
            "fixed": share(right),
            "random": mean(chance(len(plant), 1) for plant in plants),
            "class": mean(chance(len(plant), LARGEST_CLASS) for plant in plants),
        },
        "faults": {
            "fixed": share(found),
            "random": mean(chance(count, NAMES) for count in each) if each else None,
        },
    }


def standing_for(faults: Sequence[Collection[str]]) -> list[str]:
    """Return the names that stand for most faults, one after the other."""
    left: list[set[str]] = [set(fault.split()) for own in faults for fault in own]
    names: list[str] = []
    while left and len(names) < NAMES:
        seen = Counter(name for fault in left for name in fault)
        names.append(max(filter(seen.__contains__, EFFECTS), key=seen.__getitem__))
        left = [fault for fault in left if names[-1] not in fault]
    return names


def share(hits: Sequence[bool]) -> float | None:
    """Return how many of some are so [1]; None of none."""
    return sum(hits) / len(hits) if hits else None


def chance(right: int, drawn: int) -> float:
    """Return how likely some names drawn of the catalogue hold one of so many right ones [1]."""
    return 1.0 - comb(len(EFFECTS) - right, drawn) / comb(len(EFFECTS), drawn)
